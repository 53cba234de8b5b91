-- Frequency divider: one tick at every `period`-th clock in which it is enabled.
--
-- Thesis, 4.1.3 and 4.1.5: "divisor de frecuencia", which makes the motors' slow clock out of the
-- FPGA's, and whose end of count ("Fin_Cuenta") lets a driver change its state. Here it is no
-- clock but an enable: everything has the one clock of the board.

library ieee;
use ieee.std_logic_1164.all;

entity frequency_divider is
  generic (
    period     : positive;          -- clocks of the board from one tick to the next
    reset_less : boolean := false); -- goes on counting through reset
  port (
    clk, rst : in  std_logic;
    enable   : in  std_logic;       -- count this clock
    clear    : in  std_logic;       -- begin anew
    tick     : out std_logic);      -- this clock is the last of a period
end entity;

architecture counting of frequency_divider is
  -- Enabled clocks of this period. It never gets to `period`, but has a bit where that is 1.
  signal passed : natural range 0 to period := 0;
  signal last   : std_logic;
begin

  last <= '1' when passed = period - 1 else '0';
  tick <= last and enable;

  process (clk)
  begin
    if rising_edge(clk) then
      if clear = '1' then
        passed <= 0;
      elsif rst = '1' and not reset_less then
        passed <= 0;
      elsif enable = '1' then
        if last = '1' then
          passed <= 0;
        else
          passed <= passed + 1;
        end if;
      end if;
    end if;
  end process;

end architecture;
