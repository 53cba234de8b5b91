-- Manual control: two switches for each axis.
--
-- Thesis, 4.1.1 and 4.2.2: six bits, a pair for each axis, one for each sense; ascending comes
-- first where both are on. What the thesis leaves open: a switch that is on when manual mode
-- begins, or at reset, counts only after it has been off.

library ieee;
use ieee.std_logic_1164.all;

entity manual_control is
  generic (period : positive); -- clocks from one step to the next
  port (
    clk, rst  : in  std_logic;
    enable    : in  std_logic;                     -- manual mode
    jog       : in  std_logic_vector(5 downto 0);  -- x up, x down, y up, y down, z up, z down
    step      : out std_logic_vector(2 downto 0);
    direction : out std_logic_vector(2 downto 0);
    active    : out std_logic_vector(2 downto 0)); -- axes that are moved
end entity;

architecture switches of manual_control is
  signal released   : std_logic_vector(5 downto 0) := "000000"; -- off since manual mode began
  signal on_now     : std_logic_vector(5 downto 0);
  signal up, moving : std_logic_vector(2 downto 0);
  signal any, none  : std_logic;
  signal pulse      : std_logic;
begin

  on_now <= jog and released when enable = '1' else "000000";
  up     <= on_now(4) & on_now(2) & on_now(0);
  moving <= up or (on_now(5) & on_now(3) & on_now(1));
  any    <= '0' when moving = "000" else '1';
  none   <= not any;

  divider : entity work.frequency_divider
    generic map (period => period)
    port map (clk => clk, rst => rst, enable => any, clear => none, tick => pulse);

  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' or enable = '0' then
        released <= "000000";
      else
        released <= released or not jog;
      end if;
    end if;
  end process;

  step      <= moving when pulse = '1' else "000";
  direction <= up;
  active    <= moving;

end architecture;
