-- The main module: both modes, and the motors behind them.
--
-- Thesis, 4.1.1, figure 15: an automatic part and a manual part, and a multiplexer that "Switch"
-- rules. Going to manual mode resets the automatic part (4.2.2), so that the origin is where the
-- tool is left. The thesis has motors' drivers in both parts; here one set stands behind the
-- multiplexer, and what reset and mode do to the automatic part they do not do to the motors.
--
-- What the thesis has not: from `stop` on no step reaches a driver, until reset.

library ieee;
use ieee.std_logic_1164.all;

entity numerical_controller is
  generic (
    period     : positive;  -- least clocks between two steps of a motor
    z_travel   : positive;  -- steps of the tool from raised to lowered
    jog_period : positive := 1);
  port (
    clk, rst               : in  std_logic;
    mode                   : in  std_logic;                     -- 0 manual, 1 automatic
    order                  : in  std_logic_vector(33 downto 0); -- see motion_sequencer
    start                  : in  std_logic;
    jog                    : in  std_logic_vector(5 downto 0);
    stop                   : in  std_logic;
    selector               : in  std_logic_vector(1 downto 0);  -- 0 main, 1 X, 2 Y, 3 Z
    ready, error           : out std_logic;
    axis_x, axis_y, axis_z : out std_logic_vector(3 downto 0);
    count                  : out std_logic_vector(15 downto 0);
    jogging                : out std_logic_vector(2 downto 0));
end entity;

architecture structure of numerical_controller is
  signal by_hand, restart, held, sequencer_held       : std_logic;
  signal stopped                                      : std_logic := '0';
  signal wrong, sequencer_upset, order_upset          : std_logic;
  signal moves_payload                                : std_logic_vector(21 downto 0);
  signal moves_valid, moves_ready                     : std_logic;
  signal hand_step, hand_direction, hand_active       : std_logic_vector(2 downto 0);
  signal order_step, order_direction                  : std_logic_vector(2 downto 0);
  signal step, direction, moved                       : std_logic_vector(2 downto 0);
  signal at_x, at_y, at_z                             : std_logic_vector(15 downto 0);
begin

  by_hand        <= not mode;
  restart        <= rst or by_hand;
  held           <= stop or stopped or sequencer_upset or order_upset;
  sequencer_held <= held or by_hand;

  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        stopped <= '0';
      elsif stop = '1' then
        stopped <= '1';
      end if;
    end if;
  end process;

  manual : entity work.manual_control
    generic map (period => jog_period)
    port map (clk => clk, rst => rst, enable => by_hand, jog => jog, step => hand_step,
              direction => hand_direction, active => hand_active);

  sequencer : entity work.motion_sequencer
    generic map (z_travel => z_travel)
    port map (clk => clk, rst => restart, order => order, start => start, hold => sequencer_held,
              ready => ready, error => wrong, fault => sequencer_upset,
              at_x => at_x, at_y => at_y, at_z => at_z,
              moves_payload => moves_payload, moves_valid => moves_valid,
              moves_ready => moves_ready);

  by_order : entity work.automatic_control -- `automatic` is a word of Verilog
    generic map (period => period)
    port map (clk => clk, rst => restart, moves_payload => moves_payload,
              moves_valid => moves_valid, moves_ready => moves_ready, step => order_step,
              direction => order_direction, moved => moved, selector => selector, shown => count,
              at_x => at_x, at_y => at_y, at_z => at_z, fault => order_upset);

  -- The multiplexer.
  step <= "000"      when held = '1' else
          order_step when mode = '1' else
          hand_step;
  direction <= order_direction when mode = '1' else hand_direction;

  drivers : entity work.axis_drivers
    generic map (period => period)
    port map (clk => clk, rst => rst, step => step, direction => direction, moved => moved,
              refused => open, axis_x => axis_x, axis_y => axis_y, axis_z => axis_z);

  error   <= wrong or sequencer_upset or order_upset;
  jogging <= hand_active when held = '0' else "000";

end architecture;
