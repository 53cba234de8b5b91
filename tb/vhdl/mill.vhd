-- The milling machine by its pins: the controller, and what shows its work.
--
-- Thesis, 4.1.1 and 4.2.

library ieee;
use ieee.std_logic_1164.all;

entity mill is
  generic (
    period     : positive;  -- least clocks between two steps of a motor
    scan_bits  : positive;  -- binary logarithm of the clocks of a digit's turn
    jog_period : positive;
    z_travel   : positive); -- steps of the tool from raised to lowered
  port (
    clk, rst               : in  std_logic;
    mode                   : in  std_logic;                     -- 0 manual, 1 automatic
    position_x, position_y : in  std_logic_vector(15 downto 0); -- row and column
    up, down, start        : in  std_logic;
    counter_select         : in  std_logic_vector(1 downto 0);  -- 0 main, 1 X, 2 Y, 3 Z
    jog                    : in  std_logic_vector(5 downto 0);
    stop                   : in  std_logic;
    ready, error           : out std_logic;
    axis_x, axis_y, axis_z : out std_logic_vector(3 downto 0);
    leds                   : out std_logic_vector(3 downto 0);
    count                  : out std_logic_vector(15 downto 0);
    segments               : out std_logic_vector(7 downto 0);
    digits                 : out std_logic_vector(3 downto 0));
end entity;

architecture structure of mill is
  signal order                     : std_logic_vector(33 downto 0);
  signal coils_x, coils_y, coils_z : std_logic_vector(3 downto 0);
  signal chosen                    : std_logic_vector(15 downto 0);
  signal jogging                   : std_logic_vector(2 downto 0);
begin

  order <= down & up & position_y & position_x;

  controller : entity work.numerical_controller
    generic map (period => period, z_travel => z_travel, jog_period => jog_period)
    port map (clk => clk, rst => rst, mode => mode, order => order, start => start, jog => jog,
              stop => stop, selector => counter_select, ready => ready, error => error,
              axis_x => coils_x, axis_y => coils_y, axis_z => coils_z, count => chosen,
              jogging => jogging);

  monitor : entity work.monitor
    generic map (scan_bits => scan_bits)
    port map (clk => clk, rst => rst, mode => mode, axis_x => coils_x, axis_y => coils_y,
              axis_z => coils_z, jogging => jogging, count => chosen, leds => leds,
              segments => segments, digits => digits);

  axis_x <= coils_x;
  axis_y <= coils_y;
  axis_z <= coils_z;
  count  <= chosen;

end architecture;
