-- Motion sequencer: a complex movement as simple ones.
--
-- Thesis, 4.1.1, figure 16: the state machine of the main module, with its states' own numbers.
--
--   S0  waits; stores the target, works out the steps to go  -> S7 for the tool, else S1
--   S1  decides                                              -> S2 if both axes have the same
--                                                               steps, else S3; S0 if none
--   S2  orders both axes                                     -> S6
--   S3  orders the diagonal, if there is one                 -> S4
--   S4  waits for its end                                    -> S5
--   S5  orders the straight rest                             -> S6
--   S6  waits for its end                                    -> S0
--   S7  orders the tool up or down                           -> S8
--   S8  waits for its end                                    -> S0
--
-- "N_Pasos_X" and "N_Pasos_Y" are `pasos_x` and `pasos_y`. They follow target and position in
-- every clock, so that one clock in S1 is enough where the thesis waits for 20, and the rest is
-- what is left to go after the diagonal.
--
-- What the thesis leaves open: an order that is refused raises `error` and moves nothing. Up and
-- down together pass by S8. A lowered tool must mill along one of 8 directions. And a start with
-- up or down on the way is refused, while what is under way goes on.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity motion_sequencer is
  generic (z_travel : positive); -- steps of the tool from raised to lowered
  port (
    clk, rst         : in  std_logic;
    order            : in  std_logic_vector(33 downto 0); -- x 15-0, y 31-16, up 32, down 33
    start            : in  std_logic;
    hold             : in  std_logic;                     -- not ready
    ready            : out std_logic;
    error            : out std_logic;
    fault            : out std_logic;                     -- upset: see order_control
    at_x, at_y, at_z : in  std_logic_vector(15 downto 0);
    moves_payload    : out std_logic_vector(21 downto 0); -- axes 2-0, direction 5-3, steps 21-6
    moves_valid      : out std_logic;
    moves_ready      : in  std_logic);
end entity;

architecture states of motion_sequencer is
  subtype place_t is unsigned(15 downto 0);

  -- How far it is from one place to another.
  function distance(here, there : place_t) return place_t is
  begin
    if there > here then
      return there - here;
    end if;
    return here - there;
  end function;

  type state_t is (s0, s1, s2, s3, s4, s5, s6, s7, s8);
  signal state    : state_t := s0;
  signal state_to : state_t;

  alias target_x : std_logic_vector(15 downto 0) is order(15 downto 0);
  alias target_y : std_logic_vector(15 downto 0) is order(31 downto 16);
  alias up       : std_logic is order(32);
  alias down     : std_logic is order(33);

  signal goal_x, goal_y     : place_t := x"0000"; -- of the order that was taken
  signal to_x, to_y         : place_t;            -- of that order, or of the one that waits
  signal pasos_x, pasos_y   : place_t := x"0000";
  signal sense_x, sense_y   : std_logic := '0';
  signal sense_z            : std_logic := '0';   -- the tool order was up

  signal used_up            : std_logic := '0';   -- this start counts no more
  signal new_start, taken   : std_logic;
  signal wrong              : std_logic := '0';   -- the last order was refused
  signal refuse, accept     : std_logic;
  signal resting, is_ready  : std_logic;
  signal lowered            : std_logic;
  signal needs_x, needs_y   : std_logic;

  signal valid              : std_logic;
  signal axes               : std_logic_vector(2 downto 0);
  signal steps, small, large : place_t;
begin

  resting   <= '1' when state = s0 else '0';
  is_ready  <= resting and not hold;
  new_start <= start and not used_up;
  taken     <= is_ready and new_start;
  lowered   <= at_z(15); -- below the origin

  to_x    <= unsigned(target_x) when resting = '1' else goal_x;
  to_y    <= unsigned(target_y) when resting = '1' else goal_y;
  needs_x <= '0' when pasos_x = 0 else '1';
  needs_y <= '0' when pasos_y = 0 else '1';
  small   <= pasos_x when pasos_x < pasos_y else pasos_y;
  large   <= pasos_y when pasos_x < pasos_y else pasos_x;

  -- Figure 16: where to next.
  process (state, taken, up, down, needs_x, needs_y, pasos_x, pasos_y, lowered, valid, moves_ready)
  begin
    state_to <= state;
    refuse   <= '0';
    accept   <= '0';
    if state = s0 then
      if taken = '1' then
        if up = '1' and down = '1' then
          refuse   <= '1';
          state_to <= s8;
        elsif up = '1' or down = '1' then
          state_to <= s7;
        else
          state_to <= s1;
        end if;
      end if;
    elsif state = s1 then
      accept <= '1';
      if needs_x = '0' and needs_y = '0' then
        state_to <= s0;
      elsif pasos_x = pasos_y then
        state_to <= s2;
      elsif lowered = '1' and needs_x = '1' and needs_y = '1' then
        refuse   <= '1';
        state_to <= s0;
      else
        state_to <= s3;
      end if;
    elsif state = s2 or state = s5 then
      if moves_ready = '1' then
        state_to <= s6;
      end if;
    elsif state = s3 then
      if moves_ready = '1' or valid = '0' then
        state_to <= s4;
      end if;
    elsif state = s4 then
      if moves_ready = '1' then
        state_to <= s5;
      end if;
    elsif state = s6 or state = s8 then
      if moves_ready = '1' then
        state_to <= s0;
      end if;
    else -- s7
      accept <= '1';
      if moves_ready = '1' or valid = '0' then
        state_to <= s8;
      end if;
    end if;
  end process;

  -- The simple movement that each state orders.
  process (state, needs_x, needs_y, small, large, sense_z, lowered)
  begin
    valid <= '0';
    axes  <= "000";
    steps <= small;
    if state = s2 then
      valid <= '1';
      axes  <= "011";
    elsif state = s3 then
      valid <= needs_x and needs_y;
      axes  <= "011";
    elsif state = s5 then
      valid <= '1';
      axes  <= '0' & needs_y & needs_x;
      steps <= large;
    elsif state = s7 then
      valid <= sense_z xnor lowered; -- up from below, down from above
      axes  <= "100";
      steps <= to_unsigned(z_travel, 16);
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      -- A start is used up when it is taken or comes too early, until it falls. Reset takes none,
      -- but neither does it make a used one new.
      used_up <= start and (used_up or not resting or (is_ready and not rst));

      if rst = '1' then
        state   <= s0;
        wrong   <= '0';
        sense_z <= '0';
        goal_x  <= x"0000";
        goal_y  <= x"0000";
        pasos_x <= x"0000";
        pasos_y <= x"0000";
        sense_x <= '0';
        sense_y <= '0';
      else
        state <= state_to;
        if refuse = '1' or (resting = '0' and new_start = '1' and (up = '1' or down = '1')) then
          wrong <= '1';
        elsif accept = '1' then
          wrong <= '0';
        end if;
        if resting = '1' then
          goal_x  <= to_x;
          goal_y  <= to_y;
          sense_z <= up;
        end if;
        pasos_x <= distance(unsigned(at_x), to_x);
        pasos_y <= distance(unsigned(at_y), to_y);
        if to_x > unsigned(at_x) then sense_x <= '1'; else sense_x <= '0'; end if;
        if to_y > unsigned(at_y) then sense_y <= '1'; else sense_y <= '0'; end if;
      end if;
    end if;
  end process;

  ready         <= is_ready;
  error         <= wrong;
  fault         <= '0';
  moves_valid   <= valid;
  moves_payload <= std_logic_vector(steps) & sense_z & sense_y & sense_x & axes;

end architecture;
