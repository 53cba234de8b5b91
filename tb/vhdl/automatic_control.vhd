-- Automatic control: order control, the main counter, a counter for each axis, and what is shown.
--
-- Thesis, 4.1.2, figure 17: a structure and nothing else. The main counter has one sense only:
-- its "Sentido" is tied to 1. A multiplexer of 4 to 1 picks the count for the display. The
-- motors' drivers, which the thesis has in here too, stand outside: `step` goes out to them, and
-- what they really make comes back by `moved`, which is what is counted.

library ieee;
use ieee.std_logic_1164.all;

entity automatic_control is
  generic (period : positive); -- clocks from one step to the next
  port (
    clk, rst         : in  std_logic;
    moves_payload    : in  std_logic_vector(21 downto 0); -- axes 2-0, direction 5-3, steps 21-6
    moves_valid      : in  std_logic;
    moves_ready      : out std_logic;
    step, direction  : out std_logic_vector(2 downto 0);
    moved            : in  std_logic_vector(2 downto 0);
    selector         : in  std_logic_vector(1 downto 0);  -- 0 main, 1 X, 2 Y, 3 Z
    shown            : out std_logic_vector(15 downto 0);
    at_x, at_y, at_z : out std_logic_vector(15 downto 0);
    fault            : out std_logic);
end entity;

architecture structure of automatic_control is
  signal sense                             : std_logic_vector(2 downto 0);
  signal any_moved, restart                : std_logic;
  signal count_main                        : std_logic_vector(15 downto 0);
  signal count_x, count_y, count_z         : std_logic_vector(15 downto 0);
begin

  orders : entity work.order_control
    generic map (period => period)
    port map (clk => clk, rst => rst, moves_payload => moves_payload, moves_valid => moves_valid,
              moves_ready => moves_ready, count => count_main, clear => restart, step => step,
              direction => sense, fault => fault);

  any_moved <= moved(0) or moved(1) or moved(2);

  main : entity work.step_counter
    port map (clk => clk, rst => rst, step => any_moved, direction => '1', clear => restart,
              count => count_main);

  x : entity work.step_counter
    port map (clk => clk, rst => rst, step => moved(0), direction => sense(0), clear => '0',
              count => count_x);

  y : entity work.step_counter
    port map (clk => clk, rst => rst, step => moved(1), direction => sense(1), clear => '0',
              count => count_y);

  z : entity work.step_counter
    port map (clk => clk, rst => rst, step => moved(2), direction => sense(2), clear => '0',
              count => count_z);

  shown <= count_main when selector = "00" else
           count_x    when selector = "01" else
           count_y    when selector = "10" else
           count_z;

  direction <= sense;
  at_x      <= count_x;
  at_y      <= count_y;
  at_z      <= count_z;

end architecture;
