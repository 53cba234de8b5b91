-- Order control: makes the step pulses of one simple movement.
--
-- Thesis, 4.1.3, figures 18 and 19: a comparator of 16 bits, a frequency divider and a state
-- machine.
--
--   S0  rests; an order is a start with at least one axis           -> S1
--   S1  hands the divider's pulses to the axes of the order         -> S2 when the steps are made
--   S2  resets its outputs and the divider                          -> S0
--
-- The order comes as a stream: `moves_valid` is the thesis's "Start", and S0 is where it is
-- taken. The thesis compares for equality; a count that is beyond ends the movement here as well.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity order_control is
  generic (period : positive); -- clocks from one step to the next
  port (
    clk, rst      : in  std_logic;
    moves_payload : in  std_logic_vector(21 downto 0); -- axes 2-0, direction 5-3, steps 21-6
    moves_valid   : in  std_logic;
    moves_ready   : out std_logic;
    count         : in  std_logic_vector(15 downto 0); -- of the main counter
    clear         : out std_logic;                     -- of the main counter
    step          : out std_logic_vector(2 downto 0);
    direction     : out std_logic_vector(2 downto 0);
    fault         : out std_logic);                    -- upset: here no state is unused
end entity;

architecture states of order_control is
  type state_t is (s0, s1, s2);
  signal state    : state_t := s0;
  signal state_to : state_t;

  alias order_axes      : std_logic_vector(2 downto 0) is moves_payload(2 downto 0);
  alias order_direction : std_logic_vector(2 downto 0) is moves_payload(5 downto 3);
  alias order_steps     : std_logic_vector(15 downto 0) is moves_payload(21 downto 6);

  signal axes   : std_logic_vector(2 downto 0) := "000";
  signal senses : std_logic_vector(2 downto 0) := "000";
  signal steps  : unsigned(15 downto 0) := x"0000";

  signal start, made, pulse, count_on, restart : std_logic;
begin

  start <= '1' when moves_valid = '1' and order_axes /= "000" else '0';
  made  <= '1' when unsigned(count) >= steps else '0';

  divider : entity work.frequency_divider
    generic map (period => period)
    port map (clk => clk, rst => rst, enable => count_on, clear => restart, tick => pulse);

  -- Figure 19: where to next, and what each state gives out.
  process (state, start, made, pulse, axes)
  begin
    state_to    <= state;
    moves_ready <= '0';
    clear       <= '0';
    count_on    <= '0';
    restart     <= '0';
    step        <= "000";
    if state = s0 then
      moves_ready <= '1';
      if start = '1' then
        clear    <= '1';
        state_to <= s1;
      end if;
    elsif state = s1 then
      count_on <= '1';
      if made = '1' then
        state_to <= s2;
      elsif pulse = '1' then
        step <= axes;
      end if;
    else
      restart  <= '1';
      state_to <= s0;
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        state  <= s0;
        axes   <= "000";
        senses <= "000";
        steps  <= x"0000";
      else
        state <= state_to;
        if state = s0 and start = '1' then
          axes   <= order_axes;
          senses <= order_direction;
          steps  <= unsigned(order_steps);
        elsif state = s2 then
          axes <= "000";
        end if;
      end if;
    end if;
  end process;

  direction <= senses;
  fault     <= '0';

end architecture;
