// What is seen of a machine from outside: where its motors stand, by their pins alone, and its answers.

#include <algorithm>
#include <string>

namespace {

constexpr int MOST = 3;   // motors
constexpr int KINDS = 2;  // of answers

// What can be wrong. The first four are seen at the pins of a motor.
enum Wrong { NOTHING, WORD, JUMP, PULSE, PINS, MOVED, KEPT, NO_ANSWER };

// Where a motor stands, and what of its pins must be remembered for it: see `Plant` in tb/plant.py.
struct Stand {
	int64_t position = 0, origin = 0;
	int8_t phase = 0;                                  // of coils
	bool on = false;                                   // had they power
	bool step = false;                                 // and of pulses: the pin, when it changed last,
	uint8_t levels = 0;                                // DIR and ENABLE, and when one of these changed
	int64_t clock = 0, rose = 0, fell = 0, changed = 0;
};

// How a motor is driven: by coil words, or by pulses.
struct Motor {
	Pad pads[3];                                       // coil word and power; or STEP, DIR and ENABLE
	const uint32_t *count = nullptr;                   // of its steps, as the machine has it
	uint64_t mask = 0;
	int64_t first = 0;                                 // where the position is 0
	int8_t phases = 0;                                 // 0 where it has pulses
	int8_t phase_of[16];                               // by coil words; -1 for those that are none
	bool has_power = false;                            // without it all coils are off a clock later
	bool may_be_off = false;                           // they may, with nothing that shows it
	int bits[3] = {0, 0, 0};                           // of the pads, and times of the driver module
	int64_t width = 0, low = 0, setup = 0, hold = 0;

	Wrong follow(Stand &s) const { return phases ? coils(s) : pulses(s); }

	Wrong coils(Stand &s) const {
		uint64_t word = pads[0].get() & 15;
		bool was_on = s.on || !has_power;
		s.on = has_power && pads[1].get();
		if (!was_on)
			return word ? WORD : NOTHING;
		if (may_be_off && !word)
			return NOTHING;
		int now = phase_of[word];
		if (now < 0)
			return WORD;
		int turn = (now - s.phase + phases) % phases;
		s.phase = int8_t(now);
		s.position += turn > phases / 2 ? turn - phases : turn;
		return turn > 1 && turn < phases - 1 ? JUMP : NOTHING;
	}

	Wrong pulses(Stand &s) const {
		auto level = [this](int n) { return bool(pads[n].get() >> bits[n] & 1); };
		bool step = level(0), up = level(1);
		uint8_t levels = uint8_t(up | level(2) << 1);
		int64_t clock = ++s.clock;
		Wrong wrong = NOTHING;
		if (levels != s.levels) {
			if (step || s.step || (s.rose && clock - s.fell < hold))
				wrong = PINS;
			s.levels = levels, s.changed = clock;
		}
		if (step && !s.step) {
			if (clock - s.changed < setup)
				wrong = PINS;
			if (s.rose && clock - s.fell < low)
				wrong = PULSE;
			s.position += up ? 1 : -1;
			s.rose = clock;
		}
		if (!step && s.step) {
			if (clock - s.rose != width)
				wrong = PULSE;
			s.fell = clock;
		}
		s.step = step;
		return wrong;
	}
};

// The answers of a machine on its serial line: how many lines begin with each of some bytes.
struct Answers {
	int32_t time = -1;  // in a byte
	uint32_t word = 0;
	bool begun = false; // a line
	int64_t lines[KINDS] = {0, 0};

	void follow(bool level, int32_t period, const char *kinds) {
		if (time < 0) {
			if (level)
				return;
			time = 0, word = 0;
		}
		if (time % period == period / 2) {
			int32_t bit = time / period;
			word |= uint32_t(level) << bit;
			if (bit == 9) {
				time = -1;
				return received(char(word >> 1), kinds);
			}
		}
		time++;
	}

	void received(char byte, const char *kinds) {
		for (int n = 0; !begun && n < KINDS && kinds[n]; n++)
			lines[n] += byte == kinds[n];
		begun = byte != '\n';
	}

	// Without the byte and the line that were being received.
	void reset() { time = -1, begun = false; }

	bool same(const Answers &other) const { return std::equal(lines, lines + KINDS, other.lines); }
};

// All that is seen of a machine from outside.
struct Seen {
	Stand stands[MOST];
	bool cleared = false;
	Answers answers;
};

}  // namespace
