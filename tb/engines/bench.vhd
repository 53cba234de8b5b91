-- Obeys orders on stdin and answers on stdout, a line each: those of bench.v. What depends on the
-- design is put in the place of words in braces: half a period in picoseconds, the bits of all inputs
-- and of all outputs, each port in whole hex digits; the bits of one for each output, in whole digits;
-- the instance, whether an output has the value that is waited for, and the name of a waveform.
--
-- A bit that is neither 0 nor 1 makes its digit an x.

library ieee;
use ieee.std_logic_1164.all;
use std.textio.all;

entity bench is
  generic (waveform : boolean := false);
end entity;

architecture obeys of bench is
  constant half : time := {HALF} ps;

  signal clk   : std_logic := '0';
  signal given : std_logic_vector({GIVEN} - 1 downto 0) := (others => '0');
  signal seen  : std_logic_vector({SEEN} - 1 downto 0) := (others => '0');

  type nibbles is array (character range '0' to 'f') of std_logic_vector(3 downto 0);
  constant nibble : nibbles := (
    '0' => "0000", '1' => "0001", '2' => "0010", '3' => "0011",
    '4' => "0100", '5' => "0101", '6' => "0110", '7' => "0111",
    '8' => "1000", '9' => "1001", 'a' => "1010", 'b' => "1011",
    'c' => "1100", 'd' => "1101", 'e' => "1110", 'f' => "1111", others => "XXXX");
  constant digit : string(1 to 16) := "0123456789abcdef";

  procedure read_levels(variable text : in line; variable place : inout positive;
                        levels : out std_logic_vector) is
    variable bits : std_logic_vector(levels'length - 1 downto 0);
  begin
    while text(place) = ' ' loop
      place := place + 1;
    end loop;
    for n in levels'length / 4 - 1 downto 0 loop
      bits(4 * n + 3 downto 4 * n) := nibble(text(place));
      place := place + 1;
    end loop;
    levels := bits;
  end procedure;

  procedure read_number(variable text : in line; variable place : inout positive;
                        number : out natural) is
    variable value : natural := 0;
  begin
    while text(place) = ' ' loop
      place := place + 1;
    end loop;
    while place <= text'length loop
      exit when text(place) = ' ';
      value := 10 * value + character'pos(text(place)) - character'pos('0');
      place := place + 1;
    end loop;
    number := value;
  end procedure;

  function digits(levels : std_logic_vector) return string is
    variable text  : string(1 to levels'length / 4);
    variable value : natural range 0 to 15;
    variable known : boolean;
  begin
    for place in text'range loop
      value := 0;
      known := true;
      for n in levels'length - 4 * place + 3 downto levels'length - 4 * place loop
        value := 2 * value mod 16;
        if levels(n) = '1' then
          value := value + 1;
        elsif levels(n) /= '0' then
          known := false;
        end if;
      end loop;
      if known then
        text(place) := digit(value + 1);
      else
        text(place) := 'x';
      end if;
    end loop;
    return text;
  end function;

  function is_met(seen, values, enable : std_logic_vector) return boolean is
  begin
    return {MET};
  end function;
begin

  dut : entity work.{INSTANCE};

  process
    variable start  : time := 0 ns;
    variable text   : line;
    variable place  : positive;
    variable count  : natural;
    variable made   : natural;
    variable once   : natural;
    variable levels : std_logic_vector(given'range);
    variable mask, last, values : std_logic_vector(seen'range);
    variable enable : std_logic_vector({OUTPUTS} - 1 downto 0);
    variable stop   : boolean;
    variable differs : boolean;

    procedure clock is
    begin
      if now < start + half then
        wait for start + half - now;
      end if;
      clk <= '1';
      wait for half;
      clk <= '0';
      start := now;
    end procedure;

  begin
    if waveform then
      write(output, "open" & LF);
      flush(output);
    end if;
    while not endfile(input) loop
      readline(input, text);
      place := 2;
      case text(1) is
        when 's' =>
          read_levels(text, place, levels);
          given <= levels;
        when 'g' =>
          wait for 1 ps;
          write(output, digits(seen) & LF);
        when 'p' =>
          read_number(text, place, count);
          for row in 1 to count loop
            readline(input, text);
            place := 1;
            read_levels(text, place, levels);
            given <= levels;
            wait for 1 ps;
            write(output, digits(seen) & LF);
            clock;
          end loop;
        when 'r' =>
          read_number(text, place, count);
          read_number(text, place, once);
          read_levels(text, place, mask);
          read_levels(text, place, last);
          read_levels(text, place, enable);
          read_levels(text, place, values);
          made := 0;
          stop := false;
          while made < count and not stop loop
            clock;
            wait for 1 ps;
            made := made + 1;
            differs := is_x(seen) or ((seen xor last) and mask) /= (seen'range => '0');
            stop := is_met(seen, values, enable) or is_x(seen) or (once = 1 and differs);
            if differs then
              write(output, integer'image(made) & ' ' & digits(seen) & LF);
            end if;
            last := seen;
          end loop;
          write(output, "= " & integer'image(made) & LF);
        when others =>
          report "no such order: " & text.all severity failure;
      end case;
      flush(output);
    end loop;
    if now < start + half then
      wait for start + half - now;
    end if;
    wait;
  end process;

end architecture;
