// Upsets: what becomes of a machine when one of its flip-flops changes by itself, and what of its motors
// when reset comes at any time. Above are the Engine that runs it, and its pins. The machine is described by
// how its motors are driven, what counts their steps, when it is idle, and its answers.
//
// A machine is given work: rows of levels of all inputs, each for some clocks or until it is idle. So work
// waits for the machine, as people and order sources do, also for one that an upset has delayed. It is
// done once without an upset, and the state of every clock is kept: an upset begins there, and ends
// where the states are the same again, or after a while.

namespace {

struct Register {
	std::string name;
	uint32_t *curr, *next;
	size_t words, width;
};

struct Memory {
	uint32_t *curr;
	size_t words;
};

// A word of the state that is another than in the clock before.
struct Change {
	uint32_t word, value;
};

constexpr int64_t SPAN = 256;  // clocks

struct Row {
	const uint64_t *levels;
	int64_t clocks;
	bool waits, begins, rst, zero;
};

enum Verdict { HARMLESS, VISIBLE, STUCK, SILENT, VERDICTS };

uint64_t mixed(uint64_t bits) {
	bits += 0x9e3779b97f4a7c15;
	bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9;
	bits = (bits ^ bits >> 27) * 0x94d049bb133111eb;
	return bits ^ bits >> 31;
}

struct Trial {
	Engine engine;
	std::vector<Register> registers;
	std::vector<Memory> memories;
	std::vector<Motor> motors;
	std::vector<uint32_t> compared;    // registers that have to do with more than the display
	std::vector<size_t> offsets;       // of each register in the state
	std::vector<size_t> bits;          // of each bit of them all: its register
	size_t words = 0;                  // of the registers in the state; behind them are the memories
	Pad idle, error, tx;
	uint64_t idle_level = 1;           // of `idle`, where the machine is
	int32_t period = 0;                // clocks of a bit of `tx`, if it has one
	std::string kinds;                 // of answers, by their first bytes
	size_t rst;                        // number of that input
	std::vector<uint32_t> power_up;

	std::vector<Row> rows;
	std::vector<int64_t> starts, ends;  // of each row; a row where everything rests, after each
	std::vector<int32_t> row_at;        // and of each clock
	std::vector<Change> changes;        // of the state from clock to clock
	std::vector<size_t> changes_at;     // the first of each clock
	std::vector<std::vector<uint32_t>> states;  // of every SPAN-th clock
	std::vector<uint32_t> expected;     // the state of clock `expected_at`, without an upset
	int64_t expected_at = 0;
	std::vector<Seen> seen;             // after each clock
	std::vector<uint8_t> errors;

	std::vector<Row> question;          // which the machine must answer from any state
	int64_t answers[KINDS], moves[MOST];

	Trial() {
		debug_items items;
		engine.design.debug_info(&items, nullptr, "");
		std::vector<uint32_t *> known;
		for (auto &entry : items.table)
			for (auto &item : entry.second) {
				if (item.type == debug_item::MEMORY)
					memories.push_back({item.curr, item.depth * ((item.width + 31) / 32)});
				bool kind = item.type == debug_item::WIRE || item.type == debug_item::VALUE;
				if (!kind || !(item.flags & debug_item::DRIVEN_SYNC) || !item.next)
					continue;
				if (std::find(known.begin(), known.end(), item.curr) != known.end())
					continue;
				known.push_back(item.curr);
				size_t size = (item.width + 31) / 32;
				registers.push_back({entry.first, item.curr, item.next, size, item.width});
				bits.insert(bits.end(), item.width, registers.size() - 1);
				offsets.push_back(words);
				words += size;
			}
	}

	// Finds what is counted under a name, such as "controller automatic x count".
	bool find_count(const char *name, Motor &motor) {
		debug_items items;
		engine.design.debug_info(&items, nullptr, "");
		if (items.count(name) != 1 || !items[name].curr)
			return false;
		motor.count = items[name].curr;
		motor.mask = (uint64_t(1) << std::min(items[name].width, size_t(32))) - 1;
		return true;
	}

	bool is_idle() const { return idle.get() == idle_level; }

	std::vector<uint32_t> state() const {
		std::vector<uint32_t> all;
		for (auto &r : registers)
			all.insert(all.end(), r.curr, r.curr + r.words);
		for (auto &m : memories)
			all.insert(all.end(), m.curr, m.curr + m.words);
		return all;
	}

	void restore(const std::vector<uint32_t> &all) {
		const uint32_t *state = all.data();
		for (auto &r : registers) {
			std::copy(state, state + r.words, r.curr);
			std::copy(state, state + r.words, r.next);
			state += r.words;
		}
		for (auto &m : memories) {
			std::copy(state, state + m.words, m.curr);
			state += m.words;
		}
		engine.wake();
	}

	// Writes down the state of the next clock of the work.
	void keep() {
		int64_t clock = int64_t(changes_at.size());
		changes_at.push_back(changes.size());
		uint32_t *state = expected.data();
		auto follow = [&](const uint32_t *now, size_t size) {
			bool same = std::equal(now, now + size, state);
			for (size_t n = 0; n < size && !same; n++)
				if (now[n] != state[n])
					changes.push_back({uint32_t(state + n - expected.data()), state[n] = now[n]});
			state += size;
		};
		for (auto &r : registers)
			follow(r.curr, r.words);
		for (auto &m : memories)
			follow(m.curr, m.words);
		if (clock % SPAN == 0)
			states.push_back(expected);
		expected_at = clock;
	}

	// Finds the state of a clock of the work.
	const std::vector<uint32_t> &state_at(int64_t clock) {
		if (clock < expected_at || clock - expected_at > SPAN) {
			expected = states[size_t(clock / SPAN)];
			expected_at = clock / SPAN * SPAN;
		}
		while (expected_at < clock) {
			size_t next = size_t(++expected_at);
			size_t end = next + 1 < changes_at.size() ? changes_at[next + 1] : changes.size();
			for (size_t n = changes_at[next]; n < end; n++)
				expected[changes[n].word] = changes[n].value;
		}
		return expected;
	}

	void flip(size_t number, size_t bit) {
		auto &r = registers[number];
		r.curr[bit / 32] ^= 1u << bit % 32;
		r.next[bit / 32] = r.curr[bit / 32];
		engine.wake();
	}

	// Is the state that of a clock without an upset?
	bool same(int64_t clock) {
		const uint32_t *state = state_at(clock).data();
		for (auto number : compared) {
			auto &r = registers[number];
			if (!std::equal(r.curr, r.curr + r.words, state + offsets[number]))
				return false;
		}
		state += words;
		for (auto &m : memories) {
			if (!std::equal(m.curr, m.curr + m.words, state))
				return false;
			state += m.words;
		}
		return true;
	}

	void apply(const Row &row) {
		for (size_t n = 0; n < engine.pins.size(); n++)
			engine.put(n, row.levels[n]);
	}

	// Looks at the pins in a clock; where the place was called 0 it is that.
	Wrong follow(Seen &now, const Row &row) {
		Wrong wrong = NOTHING;
		for (size_t n = 0; n < motors.size(); n++) {
			wrong = std::max(wrong, motors[n].follow(now.stands[n]));
			if (now.cleared)
				now.stands[n].origin = now.stands[n].position;
		}
		now.cleared = row.zero;
		receive(now.answers, row.rst);
		return wrong;
	}

	void receive(Answers &answers, bool rst) const {
		if (rst)
			answers.reset();
		else if (period)
			answers.follow(tx.get() & 1, period, kinds.c_str());
	}

	bool counts_right(const Seen &now) const {
		for (size_t n = 0; n < motors.size(); n++)
			if ((uint64_t(motors[n].first + now.stands[n].position - now.stands[n].origin)
				^ *motors[n].count) & motors[n].mask)
				return false;
		return true;
	}

	// Writes down where the motors are, and should be; returns whether they are there.
	bool compare(const Seen &now, const Seen &expected, int64_t *place) const {
		bool right = true;
		for (size_t n = 0; n < motors.size(); n++) {
			place[n] = now.stands[n].position;
			place[MOST + n] = expected.stands[n].position;
			right &= place[n] == place[MOST + n];
		}
		return right;
	}

	bool work(int64_t timeout);
	Verdict inject(
		int64_t clock, size_t number, size_t bit, int64_t window, int64_t timeout, int64_t *place);
};

// Does all rows without an upset; false if the machine is wrong or never idle, which it must not be.
bool Trial::work(int64_t timeout) {
	starts.clear(), row_at.clear(), seen.clear(), errors.clear();
	changes.clear(), changes_at.clear(), states.clear();
	restore(power_up);
	expected = power_up;
	Seen now;
	for (size_t number = 0; number < rows.size(); number++) {
		auto &row = rows[number];
		starts.push_back(int64_t(row_at.size()));
		apply(row);
		bool was_idle = false;
		for (int64_t elapsed = 0; elapsed < row.clocks || (row.waits && !was_idle); elapsed++) {
			engine.settle();
			if (follow(now, row) || !counts_right(now) || elapsed > row.clocks + timeout)
				return false;
			row_at.push_back(int32_t(number));
			keep();
			seen.push_back(now);
			errors.push_back(uint8_t(error.get()));
			was_idle = is_idle();
			engine.edge();
		}
	}
	// Where a row has waited for the machine, and shows no error, it rests.
	ends.assign(rows.size(), -1);
	for (int64_t number = int64_t(rows.size()) - 1, end = -1; number >= 0; number--) {
		ends[number] = end;
		int64_t clock = starts[number];
		if (number && rows[number - 1].waits && !errors[clock] && !errors[clock - 1])
			end = number;
	}
	return true;
}

std::vector<Row> rows_of(
	size_t pins, int64_t rows, const uint64_t *levels, const int64_t *clocks, const uint8_t *marks
) {
	std::vector<Row> found;
	for (int64_t n = 0; n < rows; n++) {
		auto has = [mark = marks[n]](int bit) { return bool(mark >> bit & 1); };
		found.push_back({levels + n * pins, clocks[n], has(0), has(1), has(2), has(3)});
	}
	return found;
}

}  // namespace
