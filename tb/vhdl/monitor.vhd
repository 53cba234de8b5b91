-- Monitor: LEDs in manual mode, the display in automatic mode.
--
-- Thesis, 4.2.1: four LEDs show the coils of the axis that moves, X before Y before Z, and those
-- of X when none does.

library ieee;
use ieee.std_logic_1164.all;

entity monitor is
  generic (scan_bits : positive); -- see seven_segment
  port (
    clk, rst               : in  std_logic;
    mode                   : in  std_logic;                     -- 0 manual, 1 automatic
    axis_x, axis_y, axis_z : in  std_logic_vector(3 downto 0);
    jogging                : in  std_logic_vector(2 downto 0);  -- axes that are moved by hand
    count                  : in  std_logic_vector(15 downto 0);
    leds                   : out std_logic_vector(3 downto 0);
    segments               : out std_logic_vector(7 downto 0);
    digits                 : out std_logic_vector(3 downto 0));
end entity;

architecture structure of monitor is
begin

  display : entity work.seven_segment
    generic map (scan_bits => scan_bits)
    port map (clk => clk, rst => rst, value => count, enable => mode, segments => segments,
              digits => digits);

  leds <= "0000" when mode = '1' else
          axis_x when jogging(0) = '1' else
          axis_y when jogging(1) = '1' else
          axis_z when jogging(2) = '1' else
          axis_x;

end architecture;
