-- The drivers of the three motors in one.
--
-- Thesis, 4.1.4, figure 20: the "intérprete de órdenes" hands each motor its order as it is. Bits
-- 0, 1 and 2 are X, Y and Z.

library ieee;
use ieee.std_logic_1164.all;

entity axis_drivers is
  generic (period : positive); -- least clocks between two steps of a motor
  port (
    clk, rst               : in  std_logic;
    step, direction        : in  std_logic_vector(2 downto 0);
    moved, refused         : out std_logic_vector(2 downto 0);
    axis_x, axis_y, axis_z : out std_logic_vector(3 downto 0));
end entity;

architecture structure of axis_drivers is
begin

  x : entity work.coil_driver
    generic map (period => period)
    port map (clk => clk, rst => rst, step => step(0), direction => direction(0),
              moved => moved(0), refused => refused(0), coils => axis_x);

  y : entity work.coil_driver
    generic map (period => period)
    port map (clk => clk, rst => rst, step => step(1), direction => direction(1),
              moved => moved(1), refused => refused(1), coils => axis_y);

  z : entity work.coil_driver
    generic map (period => period)
    port map (clk => clk, rst => rst, step => step(2), direction => direction(2),
              moved => moved(2), refused => refused(2), coils => axis_z);

end architecture;
