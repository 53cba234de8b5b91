// Obeys orders on stdin and answers on stdout, a line each. What depends on the design is put in the place
// of macros: half a period in picoseconds, the bits of all inputs and of all outputs, each port in whole
// hex digits; the number of outputs; the wires, the instance and whether each output has the value that
// is waited for.
//
//   s LEVELS                             set all inputs
//   g                                    settle; answer outputs
//   p ROWS, then a line of LEVELS a row  set, settle, answer outputs and clock each row
//   r CLOCKS ONCE MASK LAST ENABLE VALUES  clock; answer clock and outputs whenever one under the mask
//                                        differs from before, or any is not known; stop there, with ONCE
//                                        at any difference, or where one that is enabled has its value;
//                                        then answer = and the clocks
//
// A value settles in a picosecond, at the end of which nothing is left to happen.
`timescale 1ps/1ps
module bench;
  reg clk;
  reg [`GIVEN-1:0] given;
  wire [`SEEN-1:0] seen;
  `WIRES
  `INSTANCE
  reg [`SEEN-1:0] mask, last, values;
  reg [`OUTPUTS-1:0] enable;
  wire [`OUTPUTS-1:0] met = `MET & enable;
  reg [8*4096:1] path;
  reg [7:0] order;
  reg stop, differs;
  integer once, got, count, made;
  time start;

  task clock;
    begin
      if ($time < start + `HALF) #(start + `HALF - $time);
      clk = 1;
      #(`HALF) clk = 0;
      start = $time;
    end
  endtask

  initial begin
    clk = 0;
    given = 0;
    start = 0;
    if ($value$plusargs("vcd=%s", path)) begin
      $dumpfile(path);
      $dumpvars(0, bench.dut);  // says that it does
      $fflush(32'h8000_0001);
    end
    got = 1;
    while (got == 1) begin
      got = $fscanf(32'h8000_0000, " %c", order);
      if (got == 1) case (order)
        "s": got = $fscanf(32'h8000_0000, "%h", given);
        "g": begin
          #1 $display("%h", seen);
        end
        "p": begin
          got = $fscanf(32'h8000_0000, "%d", count);
          for (made = 0; made < count; made = made + 1) begin
            got = $fscanf(32'h8000_0000, "%h", given);
            #1 $display("%h", seen);
            clock;
          end
        end
        "r": begin
          got = $fscanf(32'h8000_0000, "%d %d %h %h %h %h", count, once, mask, last, enable, values);
          got = got == 6;
          stop = 0;
          for (made = 0; made < count && !stop; made = made + 1) begin
            clock;
            #1;
            differs = ^seen === 1'bx || ((seen ^ last) & mask) !== {`SEEN{1'b0}};
            stop = |met || ^seen === 1'bx || (once && differs);
            if (differs)
              $display("%0d %h", made + 1, seen);
            last = seen;
          end
          $display("= %0d", made);
        end
        default: got = 0;
      endcase
      $fflush(32'h8000_0001);
    end
    if ($time < start + `HALF) #(start + `HALF - $time);
    $finish(0);
  end
endmodule
