library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity adder is
  generic (first : natural; forwards : boolean);
  port (clk, rst, go : in std_logic; choice : in std_logic_vector(4 downto 0);
        total : out std_logic_vector(15 downto 0); odd : out std_logic;
        wide : out std_logic_vector(63 downto 0));
end entity;

architecture rtl of adder is
  signal sum  : unsigned(15 downto 0) := to_unsigned(first, 16);
  signal turn : unsigned(63 downto 0) := (others => '0');
begin
  process (clk)
  begin
    if rising_edge(clk) then
      turn <= rotate_left(turn, 3) + unsigned(not go & choice);
      if go = '1' and forwards then
        sum <= sum + unsigned(choice);
      end if;
      if rst = '1' then
        sum  <= to_unsigned(first, 16);
        turn <= (others => '0');
      end if;
    end if;
  end process;
  total <= std_logic_vector(sum);
  odd   <= go and sum(0);
  wide  <= std_logic_vector(turn);
end architecture;
