-- Driver of one motor: four states, each with its row of table 1 of the thesis.
--
-- Thesis, 4.1.5, figures 21 and 22: a state machine whose states are all alike. It changes to a
-- neighbour when "Activo" and "Fin_Cuenta" are both 1, and "Sentido" says to which. Here "Activo"
-- is `step`, "Sentido" is `direction`, and "Fin_Cuenta" is `rested`: the divider of the thesis
-- stands still at its end until a step is made, so that no step waits longer than it must.
--
-- Reset stops steps but moves no coil, and the motor's rest goes on through it.

library ieee;
use ieee.std_logic_1164.all;

entity coil_driver is
  generic (period : positive); -- least clocks between two steps
  port (
    clk, rst  : in  std_logic;
    step      : in  std_logic;                      -- make a step
    direction : in  std_logic;                      -- 1 down the table, 0 up
    moved     : out std_logic;                      -- it is made
    refused   : out std_logic;                      -- it is not
    coils     : out std_logic_vector(3 downto 0));  -- BLACK, ORANGE, BROWN, YELLOW
end entity;

architecture states of coil_driver is
  type row_t is (row_1, row_2, row_3, row_4);
  signal row    : row_t := row_1;
  signal row_to : row_t; -- where a step leads
  -- Clocks since the last step, less one. It never gets to `period`, but has a bit where that is 1.
  signal rest   : natural range 0 to period := period - 1;
  signal rested : std_logic;
  signal go     : std_logic;
begin

  rested  <= '1' when rest = period - 1 else '0';
  go      <= step and rested and not rst;
  moved   <= go;
  refused <= step and not go;

  -- Figure 22: the transitions.
  process (row, direction)
  begin
    if row = row_1 then
      if direction = '1' then row_to <= row_2; else row_to <= row_4; end if;
    elsif row = row_2 then
      if direction = '1' then row_to <= row_3; else row_to <= row_1; end if;
    elsif row = row_3 then
      if direction = '1' then row_to <= row_4; else row_to <= row_2; end if;
    else
      if direction = '1' then row_to <= row_1; else row_to <= row_3; end if;
    end if;
  end process;

  -- Table 1: the coils.
  coils <= "0110" when row = row_1 else
           "0011" when row = row_2 else
           "1001" when row = row_3 else
           "1100";

  process (clk)
  begin
    if rising_edge(clk) then
      if go = '1' then
        row  <= row_to;
        rest <= 0;
      elsif rested = '0' then
        rest <= rest + 1;
      end if;
    end if;
  end process;

end architecture;
