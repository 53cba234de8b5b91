-- Counter of steps: 16 bits, cyclic.
--
-- Thesis, 4.1.6, figures 23 and 24: S0 waits, S1 takes one off the count, S2 adds one; "Activo"
-- leaves S0 and "Sentido" says whereto. The states of the thesis take clocks of their own, and
-- its counter has a divider so as not to run ahead of the motor. Here what is counted is a step
-- that the driver makes, in the clock in which it makes it: the three states are what is done in
-- this clock.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

entity step_counter is
  port (
    clk, rst  : in  std_logic;
    step      : in  std_logic;                       -- a step is made
    direction : in  std_logic;                       -- 1 up, 0 down
    clear     : in  std_logic;                       -- count from 0
    count     : out std_logic_vector(15 downto 0));
end entity;

architecture states of step_counter is
  type state_t is (s0_waits, s1_down, s2_up);
  signal state : state_t;
  signal total : unsigned(15 downto 0) := (others => '0');
begin

  process (step, direction)
  begin
    if step = '0' then
      state <= s0_waits;
    elsif direction = '0' then
      state <= s1_down;
    else
      state <= s2_up;
    end if;
  end process;

  process (clk)
  begin
    if rising_edge(clk) then
      if rst = '1' or clear = '1' then
        total <= x"0000";
      elsif state = s1_down then
        total <= total - 1;
      elsif state = s2_up then
        total <= total + 1;
      end if;
    end if;
  end process;

  count <= std_logic_vector(total);

end architecture;
