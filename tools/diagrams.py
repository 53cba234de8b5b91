"""Draw the timing diagrams of the documentation from the benches."""

import tempfile
from pathlib import Path

from tb.bench import CheckFailed
from tb.benches import benches
from tb.diagram import Diagram
from tb.machines import machines

from .console import Parser, Progress, UserError, command, say, write_folder_atomically
from .wave.draw import draw
from .wave.reader import Wave

__all__ = ["DOCS", "diagrams", "draw_part", "file_of", "main", "made"]

DOCS = Path(__file__).parent.parent / "docs"

WIDTH = 960
"""Width of a diagram in pixels."""

PAGE, FOLDER = "timing.md", "timing"
"""The page, and the folder of its pictures."""

ABOUT = """\
Runs the bench of each component on Amaranth's simulator, and draws a part of its waveform:
docs/timing/*.svg, and the page docs/timing.md that shows them. The same gateware gives the same
bytes.
"""

EPILOG = """\
examples:
  python -m tools.diagrams
      Draw them all again.

  python -m tools.diagrams --check
      List those that are out of date.

exit status: 0 on success, 1 if one is stale or a bench fails, 2 if they cannot be written.
"""

HEAD = """\
# Timing diagrams

One for each component, drawn from the waveform of its bench by `python -m
tools.diagrams`; a test fails when one is out of date. The benches run the components with much
shorter periods than the machine. The numbers below the diagrams count clocks; the effect of an
edge is shown after it.

`python -m tb NAME --vcd FILE` writes the whole waveform, and `python -m tools.wave` inspects it.
"""


DIAGRAMS = (
    Diagram(
        "frequency-divider",
        "A tick every 5 clocks while `enable` is on. Without it the count stays where it is; "
        "`clear` restarts the period.",
        "inputs: enable clear outputs: tick inside: dut.count", 0, 32, radix=("dut.count=dec",)),
    Diagram(
        "coil-driver",
        "Each step takes the coils one word on in the motor's table, or with `direction` 0 one "
        "back. At the end `step` is kept on: a step requested sooner than 4 clocks after "
        "the last is refused, and the coils stay.",
        "inputs: step direction outputs: coils moved refused inside: dut.rest", 20, 72),
    Diagram(
        "axis-drivers",
        "Three motors, a bit of `step` and of `direction` for each, X the lowest: each motor "
        "follows its own bit only.",
        "inputs: step direction outputs: moved axis_x axis_y axis_z", 90, 112),
    Diagram(
        "phase-driver",
        "Half steps: two windings on and one, by turns. `enable` gives power; then, as after every "
        "step, each coil word is there for 3 clocks before the next step is made.",
        "inputs: step direction enable outputs: coils ready moved inside: dut.row", 32, 62,
        radix=("dut.row=dec",)),
    Diagram(
        "step-dir-driver",
        "A pulse of 3 clocks for each step, 4 or more apart. Reversed in the middle of a pulse, it "
        "first finishes that; DIR turns when STEP has been low, and 2 clocks later the next pulse "
        "may come. `moved` is 1 in the clock before STEP rises, and at no other time.",
        "inputs: step direction enable pins: step_pin direction_pin enable_pin "
        "outputs: ready moved", 4, 64),
    Diagram(
        "pending-steps",
        "Three steps are requested before the driver makes any; `pending` counts them down as they "
        "are made. Then of six requests one is in the other direction, and cancels.",
        "requests: step direction driver: driver_step driver_direction moved "
        "outputs: pending fault", 0, 20, radix=("pending=signed",)),
    Diagram(
        "rate-generator",
        "`accumulator` grows by the rate in every clock, and a step is due where it is not below "
        "0; the "
        "step takes 40 off it. A new rate counts at once, limited to the highest, 10. A "
        "step that is due waits until it is made, and the next is due a full period after it.",
        "inputs: rate moved outputs: due inside: dut.accumulator", 70, 98,
        radix=("rate=dec",)),
    Diagram(
        "step-counter",
        "Up, down through 0 to 65534, and up again. Without a step it holds; `clear` makes it 0.",
        "inputs: step direction clear outputs: count", 0, 17, radix=("count=dec",)),
    Diagram(
        "move-to",
        "Three steps towards 4, when -2 becomes the target: it reverses at once. The position "
        "counts the steps made. No step is requested at the target, without `run`, or in a "
        "`load`, which sets the position. `target_n` is the target with its bits inverted: -5 for "
        "4, 1 for -2.",
        "inputs: target_n run load moved outputs: step direction position", 0, 42),
    Diagram(
        "ramp",
        "Twelve steps from standstill: the first at once, the others by the rates of the levels, "
        "up to 5, and down in time. Then 40 is the target, until at 16 it is 15: the motor slows "
        "down past it, stops at 20, and comes back.",
        "inputs: target moved outputs: step direction rate level position", 20, 312,
        radix=("rate=dec", "level=dec")),
    Diagram(
        "square-root",
        "Roots to a quarter: of 0 and of 1, which is 4 quarters. Two bits of the radicand are "
        "brought down in a clock, and a digit is made.",
        "inputs: start radicand outputs: busy root inside: dut.missing dut.rest", 0, 20,
        radix=("radicand=dec", "root=dec", "dut.missing=dec", "dut.rest=dec")),
    Diagram(
        "speed-profile",
        "The begin of a block, from standstill: each tick comes sooner than the one before.",
        "block: blocks_valid blocks_ready outputs: tick first speed standing inside: dut.phase",
        0, 230, radix=("speed=dec",)),
    Diagram(
        "arithmetic-unit",
        "15 x 2, in words of 4 bits: a in the clock of `start`, b in the next; the result is the "
        "words 1 and 14. Then the pair 5 and 1 is divided by 0, which gives all ones.",
        "inputs: start operation data outputs: write second result done", 162, 178,
        radix=("operation=dec", "data=dec", "result=dec")),
    Diagram(
        "formulas",
        "A word is there two clocks after its `address`. Five registers are written, and a table "
        "of 33 rows begins; while it is `busy` nothing from outside counts.",
        "inputs: address write value start table outputs: word busy done", 4, 44,
        radix=("address=dec", "value=dec", "table=dec", "word=dec")),
    Diagram(
        "g-code-control",
        "A feed hold (0x21): it is resumed (0x7E) only once the machine stands. Then a hard limit: "
        "stopped in the next clock, until a reset (0x18); a lock stays after it.",
        "inputs: moving standing limits unlock command code outputs: hold stop reset enable "
        "substate state: dut.control_state_state", 0, 17, radix=("code=hex", "substate=dec")),
    Diagram(
        "backlash",
        "After each reversal 3 steps only take up backlash and are not counted; where 2 are taken "
        "up "
        "and it reverses again, 2. A reset leaves this state. "
        "Then the backlash is 1.",
        "inputs: backlash moved direction outputs: counted inside: dut.left", 0, 42,
        radix=("backlash=dec", "dut.left=dec")),
    Diagram(
        "backlash-compensator",
        "Three steps are requested up, and a clock after each tick one is added, until the load "
        "has followed by three; each is counted against its direction when it is requested.",
        "inputs: step tick pending moved direction outputs: extra extra_direction correct "
        "correct_direction busy inside: dut.slack dut.ahead", 0, 24,
        radix=("dut.slack=dec", "dut.ahead=dec")),
    Diagram(
        "limits",
        "The high switch of the lower axis bounces. It counts as on from its first touch until it "
        "has settled, and no other switch does.",
        "inputs: low high outputs: at_low at_high", 44, 62),
    Diagram(
        "axis",
        "From 4 back to 1: DIR turns, two steps take up the backlash and are not counted, three "
        "are. "
        "Then the switch at the low end is on and the target is below: due steps are blocked until "
        "the target is above. `target_n` is the target with its bits inverted: -2 for 1.",
        "inputs: target_n low rate pins: step_pin direction_pin outputs: moved limit_hit "
        "in_position position", 82, 190),
    Diagram(
        "block-queue",
        "A block is written word by word, and counts with the last word.",
        "words: write_valid write_ready write_payload.address write_payload.data "
        "write_payload.last outputs: count free empty exit", 0, 60,
        radix=("count=dec", "free=dec", "exit=dec")),
    Diagram(
        "step-accumulator",
        "Parts of a step are added, of which 1024 are a whole one: a step comes with the sum "
        "that passes it.",
        "inputs: load start add term outputs: step direction quarter", 0, 24),
    Diagram(
        "step-ratio",
        "Quarter steps of an axis with 100 steps/m become steps of one with 78: one in five or "
        "six.",
        "inputs: load residual quarter forward outputs: step direction", 0, 60,
        radix=("residual=dec",)),
    Diagram(
        "rotator",
        "Half turns: by turns x and y move by a small part of the other.",
        "inputs: load turn outputs: ready vector moves_u moves_v", 0, 16,
        radix=("vector=signed",)),
    Diagram(
        "path-walk",
        "A line of 3, -5 and 16 steps in 16 ticks.",
        "segment: segments_valid segments_ready inputs: tick last outputs: ready busy step "
        "direction", 30, 130),
    Diagram(
        "block-loader",
        "The last words of a line, which is offered to walk and profile, and starts when the "
        "profile takes it.",
        "words: blocks_valid blocks_ready blocks_payload.last outputs: profile_valid "
        "profile_ready segments_valid segments_ready take", 20, 50),
    Diagram(
        "nominal-speed",
        "A block is loaded, ready when its speed is known, and taken; so is the next.",
        "inputs: load take outputs: ready inside: dut.of_running dut.place", 0, 120),
    Diagram(
        "overrides",
        "The feed falls by 1 %, the spindle by 30 %, and rises by 2; rapids have a quarter. Then "
        "the spindle stops, for as long as it is held, and all are restored.",
        "inputs: command code standing held restore outputs: feed rapid spindle "
        "outputs.clockwise changed", 22, 47, radix=("code=hex",)),
    Diagram(
        "accessory-restart",
        "With beats in all clocks: the spindle is turned on and has 4 of them, but is turned off "
        "again; then it has them, and the coolant 2.",
        "inputs: off restart outputs: spindle_off coolant_off restarted inside: dut.left", 0, 16),
    Diagram(
        "block-motion",
        "The first line begins: its steps come ever closer.",
        "inputs: words_valid words_ready made outputs: still idle step direction", 0, 6000),
    Diagram(
        "g-code-planner",
        "The words of a block, those of the plan first and last.",
        "action: actions_valid actions_ready words: words_valid words_ready "
        "words_payload.address words_payload.last", 2500, 2690,
        radix=("words_payload.address=dec",)),
    Diagram(
        "point-store",
        "Points 1 and 3 are stored, 0 is not. Whether a point is stored is valid at "
        "once, and its position with the next clock.",
        "inputs: number store place_0 place_1 outputs: stored found_0 found_1", 0, 8),
    Diagram(
        "order-control",
        "A movement of X and Y by 5 steps is taken with `valid` and `ready`. Its steps come a "
        "period of 4 clocks apart, until the counter has as many as were ordered; then it is ready "
        "for the next.",
        "order: moves_valid moves_ready moves_payload.axes moves_payload.steps "
        "state: dut.order_state_state outputs: clear step direction counter: count", 25, 51,
        radix=("count=dec",)),
    Diagram(
        "motion-sequencer",
        "An order to (9, 1) from (3, 3) becomes two movements: 2 steps along a diagonal, X forward "
        "and Y back, then 4 of X alone.",
        "order: start order.x order.y outputs: ready error state: dut.motion_state_state "
        "movements: moves_valid moves_payload.axes moves_payload.direction moves_payload.steps "
        "position: at_x at_y", 6, 20),
    Diagram(
        "automatic-control",
        "A movement of X by 5 becomes steps and counts. The second step is refused by the motors: "
        "it is not counted, and repeated. `shown` is the count that `select` selects.",
        "movement: moves_valid moves_ready moves_payload.axes moves_payload.steps "
        "steps: step moved direction display: select shown counts: x.count", 0, 26,
        radix=("shown=dec",)),
    Diagram(
        "manual-control",
        "Two switches per axis: X up, X down, and both, which is up. While a switch is on, a step "
        "comes every 4 clocks; between two jogs nothing moves.",
        "inputs: enable jog outputs: active direction step", 0, 28),
    Diagram(
        "numerical-controller",
        "X is jogged by three steps; with `mode` this position becomes the origin, and the order "
        "to (3, 1) goes there by a step of X and Y together, then two of X alone. The coils "
        "continue from where they were.",
        "inputs: mode jog start order.x order.y outputs: ready axis_x axis_y counts: x.count "
        "y.count", 0, 36),
    Diagram(
        "guarded-controller",
        "Two controllers side by side, of which the first drives the motors. At clock 31 a bit of "
        "its count of X is upset. A clock later the error shows, and the coils stay as they are, "
        "in manual mode too, until a reset; then the next order is carried out.",
        "inputs: rst mode jog start order.x outputs: ready error axis_x "
        "drives: main.automatic.x.count watches: shadow.automatic.x.count", 18, 67),
    Diagram(
        "start-handshake",
        "An order is handed on by `start`, which holds until `ready` falls; it is taken from its "
        "source only when `ready` has risen again. After an error no order is taken or started.",
        "orders: orders_valid orders_ready orders_payload.x machine: ready error start order.x "
        "state: dut.handshake_state_state", 0, 39),
    Diagram(
        "spiral-walk",
        "Around a pixel in ever larger rings. `near` holds for the pixel and the ring that touches "
        "it; `inside` is 1 for places in the picture, of 4 rows and 5 columns. Rows and columns "
        "before the first count down from 31.",
        "inputs: home centre advance outputs: row column inside near", 0, 40),
    Diagram(
        "square-generator",
        "Four corners for every start, each offered until it is taken.",
        "inputs: start orders_ready outputs: busy orders_valid orders_payload.x orders_payload.y "
        "state: dut.square_state_state", 0, 40),
    Diagram(
        "coordinate-generator",
        "Once the picture is copied from block RAM, it searches in rings for the nearest pixel "
        "left to mill, and orders the tool up, to it, and down.",
        "inputs: orders_ready outputs: busy orders_valid orders_payload.x orders_payload.y "
        "orders_payload.up orders_payload.down state: dut.coordinates_state_state "
        "picture: dut.row dut.column", 16, 44),
    Diagram(
        "order-ledger",
        "A session is opened behind order 4; order 5 is taken, and its repetition does nothing. "
        "Then come the session once more, a damaged line, and 7, which is too early; 6 is taken, "
        "and with it the queue is full. An answer comes one clock after its request.",
        "requests: requests_valid requests_payload.good requests_payload.value.number "
        "answers: answers_valid answers_payload.outcome answers_payload.taken answers_payload.done "
        "orders: orders_valid orders_ready orders_payload.x", 4, 30),
    Diagram(
        "debouncer",
        "Bounces do not pass. A stable level does, at the second tick after it began; a gap of "
        "7 clocks, less than the period of 8, is ignored.",
        "contacts: i levels: o inside: dut.divider.tick", 60, 155),
    Diagram(
        "spindle-power",
        "The power of a spindle at a quarter of its speed; then it is that of a laser on a path at "
        "half of its feed.",
        "inputs: on scaled outputs: power state: dut.power_state_state", 0, 220),
    Diagram(
        "power-pwm",
        "The first period has no power yet, the second half of it.",
        "inputs: power outputs: pin", 0, 3000),
    Diagram(
        "servo-pulse",
        "With a period of 5 ms: the first pulse has no length yet, then they follow the power.",
        "inputs: power outputs: pin beat", 0, 19_900),
    Diagram(
        "string-length",
        "A point moves away from the pulley, at first across and down at once: where the length is "
        "no longer the nearest it takes a step.",
        "inputs: tick away place: across below length outputs: step longer busy", 0, 60,
        radix=("across=dec", "below=dec", "length=dec")),
    Diagram(
        "string-motor",
        "Two steps on request, `zero`, and then a length that is followed: a step every 3 clocks "
        "as long as the string has not that length.",
        "inputs: length follow step longer zero enable outputs: moved behind made coils", 0, 40,
        radix=("length=dec", "made=dec")),
    Diagram(
        "hanging",
        "Ticks to the right, each taken back and given again in adjacent clocks: both strings take "
        "one when neither works on another.",
        "inputs: step direction place: across below lengths_0 lengths_1 outputs: busy", 0, 60,
        radix=("across=dec", "below=dec", "lengths_0=dec", "lengths_1=dec")),
    Diagram(
        "bowed-line",
        "Ticks lead the place to the end, one when the one before is taken. Then the left motor "
        "has a step each pace, and the right one its fewer steps evenly among them.",
        "inputs: start allowed point_0 point_1 target_0 target_1 "
        "outputs: active tick drawing follow", 0, 60,
        radix=("point_0=dec", "point_1=dec", "target_0=dec", "target_1=dec")),
    Diagram(
        "string-cycles",
        "A bowed line, and then a homing cycle, which begins.",
        "inputs: bows start moved behind outputs: active drawing follow restart done stage step", 0,
        80),
    Diagram(
        "string-homing",
        "The left string is wound, and the right one paid out, until the switch of the left one "
        "closes; then that is paid out slowly until it opens, and is 0.",
        "inputs: allowed switches moved outputs: stage step longer zero", 0, 70),
    Diagram(
        "wall-dialect",
        "A line of G-code passes. Of a command nothing does: it is answered, as the place is not "
        "known.",
        "line: lines_valid lines_ready lines_payload.byte lines_payload.end passed: items_valid "
        "items_ready answered own said: bytes_valid bytes_payload", 0, 60,
        radix=("lines_payload.byte=hex", "bytes_payload=hex")),
    Diagram(
        "core-xy",
        "A step of X turns both motors forward, one of Y turns them against each other; where both "
        "come at once, that of Y is a clock later.",
        "axes: step direction motors: motor_step motor_direction busy", 0, 16),
    Diagram(
        "step-dir-pair",
        "Two motors of one axis make each step in the same clock, or, where one of them is halted, "
        "the other alone.",
        "inputs: step direction halt pins: step_pin second_step_pin direction_pin "
        "second_direction_pin moved", 0, 50),
    Diagram(
        "motor-squaring",
        "Each motor halts at its own switch, and stays there when that opens again, until the next "
        "search.",
        "inputs: seeks switches moved outputs: halt failed", 0, 30),
    Diagram(
        "contact-filter",
        "A level passes once it has been there in three ticks, which are half of a `period` of 8, "
        "and then of 2, apart; it ends with the clock after the input, and a reset leaves it.",
        "inputs: i period rst outputs: o inside: dut.tick", 22, 79),
    Diagram(
        "glitch-filter",
        "Bounces do not pass. A level does once it has been there for 8 clocks, and not a clock "
        "later; it ends with the clock after the input, and a reset leaves it.",
        "inputs: i rst outputs: o inside: dut.divider.tick", 0, 58),
    Diagram(
        "seven-segment",
        "One digit at a time, from the right, dark between two: the value is 0123. Digits and "
        "segments are lit by 0.",
        "inputs: value enable outputs: digits segments", 0, 66),
    Diagram(
        "monitor",
        "By hand the LEDs show the coils of the axis that is jogged, X before Y before Z, and the "
        "display is dark. In automatic mode it shows the count, and the LEDs are dark.",
        "inputs: mode jogging axis_x axis_y axis_z count outputs: leds digits segments", 0, 96),
    Diagram(
        "uart-receiver",
        "Each of the ten bits of a byte, 16 clocks long here, is sampled around its middle. Each "
        "bit is disturbed there for a clock, which the majority of three samples corrects.",
        "inputs: rx bytes_ready outputs: bytes_valid bytes_payload.byte bytes_payload.error "
        "state: dut.receiver_state_state inside: dut.word", 0, 176,
        radix=("bytes_payload.byte=hex", "dut.word=bin")),
    Diagram(
        "uart-transmitter",
        "Three bytes follow each other: the next is taken with the last clock of a stop bit, and "
        "its start bit is on the line at once.",
        "bytes: bytes_valid bytes_ready bytes_payload outputs: tx inside: dut.left", 0, 340,
        radix=("bytes_payload=hex",)),
    Diagram(
        "line-reader",
        "Bytes outside a frame are dropped. After `:` (0x3A) three bytes are stored, and passed on "
        "after 0x0D, followed by an end. Of the second line, which is too long, only an end with "
        "code 1 is passed on.",
        "bytes: bytes_valid bytes_ready bytes_payload.byte lines: items_valid items_ready "
        "items_payload.end items_payload.byte inside: dut.inside dut.count dut.long", 0, 34,
        radix=("bytes_payload.byte=hex", "items_payload.byte=hex", "dut.count=dec")),
    Diagram(
        "realtime-filter",
        "A real-time command is taken out of the bytes, and is there for a clock.",
        "bytes: bytes_valid bytes_ready bytes_payload.byte passed: rest_valid rest_ready "
        "commands: command code", 0, 10, radix=("bytes_payload.byte=hex",)),
    Diagram(
        "line-buffer",
        "`ab`, CR and LF: the line ends once.",
        "bytes: bytes_valid bytes_ready bytes_payload.byte lines: items_valid items_ready "
        "items_payload.end items_payload.byte outputs: free", 0, 24,
        radix=("bytes_payload.byte=hex", "items_payload.byte=hex", "free=dec")),
    Diagram(
        "word-reader",
        "`mov` is the first of a table of five words, a bit each in `alive`, from the lowest: "
        "after `m` MOV and MOT are left. The space after it stays in the line. Then MOT is read "
        "up to a 2 (0x32), with which a number begins.",
        "line: items_valid items_ready items_payload.byte words: words_valid words_ready "
        "words_payload.known words_payload.index inside: dut.place dut.alive", 0, 11,
        radix=("items_payload.byte=hex", "dut.alive=bin", "dut.place=dec")),
    Diagram(
        "decimal-reader",
        "1500, then -42: digits are taken, one per clock; the space after them completes the "
        "number, and stays in the line.",
        "line: items_valid items_ready items_payload.byte numbers: numbers_valid numbers_ready "
        "numbers_payload.value numbers_payload.error inside: dut.negative", 0, 13,
        radix=("items_payload.byte=hex", "numbers_payload.value=signed")),
    Diagram(
        "fixed-point",
        "The digits of 38.2; then the decimals that it lacks are added.",
        "inputs: clear take digit decimal finish outputs: done number.value", 0, 16,
        radix=("number.value=dec",)),
    Diagram(
        "g-code-reader",
        "A word is given when its number has ended.",
        "line: items_valid items_ready items_payload.byte words: words_valid words_ready "
        "words_payload.character words_payload.kind", 0, 30,
        radix=("items_payload.byte=hex", "words_payload.character=hex")),
    Diagram(
        "g-code-interpreter",
        "After a reset four sums clear the offset of G92, the length of the tool, feed, speed and "
        "tool, and where the probe touched; one sets the origin. Then a position is taken, and "
        "words of a line.",
        "position: position_valid position_ready line: words_valid words_ready "
        "words_payload.character outputs: actions_valid answers_valid "
        "state: dut.interpreter_state_state",
        118, 146, radix=("words_payload.character=hex",)),
    Diagram(
        "g-code-line",
        "G91, X, and then G90, a second word of the group of G91: error 21.",
        "word: take item.character outputs: has_value line.axes error", 0, 9,
        radix=("item.character=hex", "error=dec")),
    Diagram(
        "g-code-lister",
        "The modes of a list come one after the other; the number of the tool is divided.",
        "inputs: start list divided outputs: divide parts_valid parts_payload.text "
        "parts_payload.value done "
        "state: dut.lister_state_state", 0, 40, radix=("parts_payload.value=dec",)),
    Diagram(
        "g-code-coordinates",
        "The words of the line are stored, and their sums computed: 24 clocks.",
        "inputs: write address run outputs: done changed beyond", 0, 40,
        radix=("address=dec",)),
    Diagram(
        "unit-converter",
        "A feed in inches a minute, then a length: a quotient takes a clock a bit.",
        "inputs: run outputs: address write done too_long state: dut.converter_state_state",
        0, 215, radix=("address=dec",)),
    Diagram(
        "g-code-setting-store",
        "$100 is read; while `trial` is 1 it reads as what may become of it; then it is written.",
        "inputs: address write_address data trial write outputs: number value", 0, 7,
        radix=("address=dec", "write_address=dec", "data=dec", "number=dec", "value=dec")),
    Diagram(
        "g-code-homing",
        "Z seeks its switch, the place of which is asked for; then it pulls off.",
        "inputs: switches moving homed outputs: request_kind request_axis request_back brake "
        "latch place restart", 0, 130),
    Diagram(
        "g-code-probing",
        "A line is planned; `latch` keeps where, until the probe touches. Once it stands, it "
        "begins there and where it is, and lists it.",
        "inputs: actions_valid actions_ready idle contact standing outputs: passed_valid latch "
        "brake measures restart listing touched", 0, 27),
    Diagram(
        "stored-program",
        "A line has begun when the program is asked for: it is ended as damaged, 2, and when that "
        "is answered the program runs. The rest of the line is dropped.",
        "line: lines_valid lines_ready run outputs: items_valid items_payload.byte "
        "items_payload.end running answer: answered state: dut.program_state_state", 0, 42),
    Diagram(
        "stored-lines",
        "At the start the text G54 is run as a line, and its answer becomes a part of a list. Then "
        "G21 comes as text 2, and is kept when its line is accepted; a line follows, with `run`.",
        "outputs: items_valid items_payload.byte items_payload.end answer: answers_valid "
        "replies_valid replies_payload.text text: slot writing seen character keep line: "
        "lines_valid run state: dut.lines_state_state", 0, 72,
        radix=("items_payload.byte=hex", "character=hex")),
    Diagram(
        "thesis-dialect",
        "The end of a line that moves has come: M3 is added before it. Then G28 waits until the "
        "machine rests, and becomes `$H`.",
        "line: words_valid words_ready words_payload.kind words_payload.character passed: "
        "passed_valid passed_payload.kind passed_payload.character inputs: resting answered "
        "state: dut.thesis_state_state", 26, 66,
        radix=("words_payload.character=hex", "passed_payload.character=hex")),
    Diagram(
        "g-code-gate",
        "A line of two words is passed; then the machine is locked, and the end of the same line "
        "has status 9.",
        "line: words_valid words_ready words_payload.kind words_payload.character passed: "
        "passed_valid passed_payload.kind passed_payload.status inputs: locked",
        0, 22, radix=("words_payload.character=hex",)),
    Diagram(
        "g-code-reporter",
        "`ok`, then `error:33`: the number comes out of the writer.",
        "answers: answers_valid answers_ready answers_payload bytes: bytes_valid bytes_payload "
        "state: dut.reporter_state_state inside: dut.item dut.full", 0, 60,
        radix=("answers_payload=dec", "bytes_payload=hex", "dut.item=hex")),
    Diagram(
        "decimal-writer",
        "205: the powers of ten that are too large are skipped, then 100 is subtracted twice, "
        "10 not at all, 1 five times. Each digit holds until it is taken.",
        "number: numbers_valid numbers_ready numbers_payload bytes: bytes_valid bytes_ready "
        "bytes_payload state: dut.writer_state_state inside: dut.place dut.left dut.digit", 0, 34,
        radix=("bytes_payload=hex", "dut.left=dec", "dut.digit=dec", "dut.place=dec",
               "numbers_payload=signed")),
    Diagram(
        "text-source",
        "`ok`, then `?`, then the beginning of a longer one of which a byte is taken every third "
        "clock. The first byte is there two clocks after the number was taken.",
        "number: numbers_valid numbers_ready numbers_payload bytes: bytes_valid bytes_ready "
        "bytes_payload inside: dut.place", 0, 24, radix=("bytes_payload=hex", "dut.place=dec")),
    Diagram(
        "hex-reader",
        "`3C`, then the eight digits of its CRC; the end of the line gives a message that is good. "
        "The register of the CRC is then at the residue that every right line leaves. The next "
        "line is as right, but damaged on its way.",
        "line: items_valid items_ready items_payload.end items_payload.byte "
        "messages: messages_valid messages_ready messages_payload.good messages_payload.value "
        "inside: dut.count crc.crc_reg", 0, 29,
        radix=("items_payload.byte=hex", "messages_payload.value=hex", "dut.count=dec",
               "crc.crc_reg=hex")),
    Diagram(
        "hex-writer",
        "`=`, the digits 09AF, their CRC from its lowest digit, CR and LF. Each byte holds until "
        "it is taken.",
        "messages: messages_valid messages_ready messages_payload bytes: bytes_valid bytes_ready "
        "bytes_payload inside: dut.left", 0, 28,
        radix=("messages_payload=hex", "bytes_payload=hex", "dut.left=dec")),
)
"""Those of components, in the order of the page: from steps to pins, orders to steps, where orders
come from, people, serial lines."""


def diagrams() -> list[Diagram]:
    """Return every diagram, in the order of the page: components, then machines."""
    return [*DIAGRAMS, *(each for machine in machines().values() for each in machine.diagrams)]


def file_of(diagram: Diagram) -> str:
    """Return where a diagram is below docs."""
    return f"{FOLDER}/{diagram.bench}.svg"


def draw_part(diagram: Diagram, vcd: Path) -> str:
    """Draw a diagram from the waveform that its bench has written."""
    return draw(Wave(vcd), diagram.signals.split(), f"{diagram.start}clk", f"{diagram.end}clk",
                cycles=True, title=diagram.title, radix=diagram.radix, width=WIDTH)


def svg(diagram: Diagram) -> str:
    """Run the bench of a diagram, and draw it."""
    with tempfile.TemporaryDirectory() as folder:
        vcd = Path(folder) / "wave.vcd"
        benches()[diagram.bench].run(vcd)
        return draw_part(diagram, vcd)


def made() -> dict[str, bytes]:
    """Draw everything: files by their names below docs.

    Raises
    ------
    CheckFailed
        If a bench fails.
    """
    files = {}
    page = [HEAD]
    every = diagrams()
    with Progress(len(every), "diagrams", "drawing") as progress:
        for diagram in every:
            files[file_of(diagram)] = svg(diagram).encode()
            page.append(f"## {diagram.title}\n\n{diagram.shows}\n\n"
                        f"![{diagram.title}: timing diagram]({file_of(diagram)})\n")
            progress.advance()
    return {**files, PAGE: "\n".join(page).encode()}


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.diagrams", machines=True, description=ABOUT,
                    epilog=EPILOG)
    parser.add_argument("--check", action="store_true", help="write nothing, say what is stale")
    parser.add_argument("--docs", metavar="FOLDER", type=Path, default=DOCS,
                        help="where the page is (default: docs)")
    args = parser.parse_args(argv)
    if not args.docs.is_dir():
        raise UserError(f"{args.docs} is no folder")
    try:
        files = made()
    except CheckFailed as failure:
        say(f"a bench failed at {failure}; python -m tb all tells which")
        return 1
    if args.check:
        return _check(args.docs, files)
    write_folder_atomically(args.docs, files)
    say(f"wrote {args.docs / PAGE} and {len(files) - 1} diagrams in {args.docs / FOLDER}")
    return 0


def _check(docs: Path, files: dict[str, bytes]) -> int:
    there = {f"{FOLDER}/{path.name}" for path in (docs / FOLDER).glob("*.svg")}
    stale = [f"{name} is stale" for name, data in files.items()
             if not (docs / name).is_file() or (docs / name).read_bytes() != data]
    stale += [f"{name} belongs to no component" for name in sorted(there - set(files))]
    for line in stale:
        say(line)
    say(f"{len(stale)} of {len(files)} files are not as the gateware; python -m tools.diagrams "
        "draws them again" if stale else f"{len(files)} files are as the gateware")
    return 1 if stale else 0


if __name__ == "__main__":
    raise SystemExit(main())
