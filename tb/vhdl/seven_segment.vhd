-- Display of four digits with seven segments each.
--
-- Thesis, 4.2.1, figure 25: the 16 bits are four numbers of 4 bits, and a multiplexer hands one
-- after the other to the segments. What the thesis leaves open: no digit is on in the first and
-- the last eighth of its turn, so that nothing of its neighbour shows. The board's levels are
-- active low.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity seven_segment is
  generic (scan_bits : positive); -- binary logarithm of the clocks of a turn, 3 or more
  port (
    clk, rst : in  std_logic;
    value    : in  std_logic_vector(15 downto 0);
    enable   : in  std_logic;
    segments : out std_logic_vector(7 downto 0);  -- point, g to a
    digits   : out std_logic_vector(3 downto 0)); -- 0 is the rightmost
end entity;

architecture scanned of seven_segment is
  signal clocks : unsigned(scan_bits + 1 downto 0) := (others => '0');
  signal turn   : std_logic_vector(1 downto 0);
  signal eighth : std_logic_vector(2 downto 0);
  signal number : std_logic_vector(3 downto 0);
  signal anodes : std_logic_vector(3 downto 0);
  signal bars   : std_logic_vector(6 downto 0); -- lit: g, f, e, d, c, b, a
begin

  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' then
        clocks <= (others => '0');
      else
        clocks <= clocks + 1;
      end if;
    end if;
  end process;

  turn   <= std_logic_vector(clocks(scan_bits + 1 downto scan_bits));
  eighth <= std_logic_vector(clocks(scan_bits - 1 downto scan_bits - 3));

  number <= value(3 downto 0)   when turn = "00" else
            value(7 downto 4)   when turn = "01" else
            value(11 downto 8)  when turn = "10" else
            value(15 downto 12);
  anodes <= "0001" when turn = "00" else
            "0010" when turn = "01" else
            "0100" when turn = "10" else
            "1000";
  digits <= not anodes when enable = '1' and eighth /= "000" and eighth /= "111" else "1111";

  bars <= "0111111" when number = x"0" else
          "0000110" when number = x"1" else
          "1011011" when number = x"2" else
          "1001111" when number = x"3" else
          "1100110" when number = x"4" else
          "1101101" when number = x"5" else
          "1111101" when number = x"6" else
          "0000111" when number = x"7" else
          "1111111" when number = x"8" else
          "1101111" when number = x"9" else
          "1110111" when number = x"A" else
          "1111100" when number = x"B" else
          "0111001" when number = x"C" else
          "1011110" when number = x"D" else
          "1111001" when number = x"E" else
          "1110001";
  segments <= '1' & not bars;

end architecture;
