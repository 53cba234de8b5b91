// Upsets: what becomes of a milling machine when one of its flip-flops changes by itself, and what of
// its coils when reset comes at any time. Above is the Engine that runs it.
//
// A machine is given work: rows of levels of all inputs, each for some clocks or until it is ready. So
// work waits for the machine, as people and order sources do, also for one that an upset has delayed.
// It is done once without an upset, and the state of every clock is kept: an upset begins there, and
// ends where the states are the same again, or after a while.

#include <algorithm>
#include <string>

namespace {

constexpr int AXES = 3;

struct Register {
	std::string name;
	uint32_t *curr, *next;
	size_t words, width;
};

// Where three motors stand, of which nothing is known but their coil words: see `Plant` in tb/plant.py.
struct Motors {
	int8_t phase[AXES] = {0, 0, 0};
	bool cleared = false;
	int64_t position[AXES] = {0, 0, 0};
	int64_t origin[AXES] = {0, 0, 0};

	// Gives 0, or what no motor can follow: 1 an illegal word, 2 a jump of two phases.
	int follow(int axis, uint64_t word) {
		static const int8_t PHASES[16] = {
			-1, -1, -1, 1, -1, -1, 0, -1, -1, 2, -1, -1, 3, -1, -1, -1};
		int now = PHASES[word & 15];
		if (now < 0)
			return 1;
		int turn = (now - phase[axis]) & 3;
		phase[axis] = int8_t(now);
		position[axis] += turn == 3 ? -1 : turn;
		return turn == 2 ? 2 : 0;
	}
};

struct Row {
	const uint64_t *levels;
	int64_t clocks;
	bool waits, rst, automatic;
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
	std::vector<uint32_t *> counts;    // of each axis, as the machine has it
	std::vector<uint32_t> compared;    // registers that have to do with more than the display
	std::vector<size_t> offsets;       // of each register in the state
	std::vector<size_t> bits;          // of each bit of them all: its register
	size_t words = 0;                  // of the state
	Pad ready, error, coils[AXES];
	Pin rst;
	std::vector<uint32_t> power_up;

	std::vector<Row> rows;
	std::vector<int64_t> starts, ends;  // of each row; a row where everything rests, after each
	std::vector<int32_t> row_at;        // and of each clock
	std::vector<uint32_t> states;
	std::vector<Motors> motors;         // after each clock
	std::vector<uint8_t> errors;

	Trial() {
		debug_items items;
		engine.design.debug_info(&items, nullptr, "");
		std::vector<uint32_t *> seen;
		for (auto &entry : items.table)
			for (auto &item : entry.second) {
				bool kind = item.type == debug_item::WIRE || item.type == debug_item::VALUE;
				if (!kind || !(item.flags & debug_item::DRIVEN_SYNC) || !item.next)
					continue;
				if (std::find(seen.begin(), seen.end(), item.curr) != seen.end())
					continue;
				seen.push_back(item.curr);
				size_t size = (item.width + 31) / 32;
				registers.push_back({entry.first, item.curr, item.next, size, item.width});
				bits.insert(bits.end(), item.width, registers.size() - 1);
				offsets.push_back(words);
				words += size;
			}
	}

	// Finds what is counted under a name, such as "controller automatic x count".
	bool find_count(const char *name) {
		debug_items items;
		engine.design.debug_info(&items, nullptr, "");
		if (items.count(name) != 1 || !items[name].curr)
			return false;
		counts.push_back(items[name].curr);
		return true;
	}

	void save(uint32_t *state) const {
		for (auto &r : registers) {
			std::copy(r.curr, r.curr + r.words, state);
			state += r.words;
		}
	}

	void restore(const uint32_t *state) {
		for (auto &r : registers) {
			std::copy(state, state + r.words, r.curr);
			std::copy(state, state + r.words, r.next);
			state += r.words;
		}
		engine.settled = false;
	}

	void flip(size_t number, size_t bit) {
		auto &r = registers[number];
		r.curr[bit / 32] ^= 1u << bit % 32;
		r.next[bit / 32] = r.curr[bit / 32];
		engine.settled = false;
	}

	// Is the state that of a clock without an upset?
	bool same(int64_t clock) const {
		const uint32_t *state = &states[clock * words];
		for (auto number : compared) {
			auto &r = registers[number];
			for (size_t n = 0; n < r.words; n++)
				if (r.curr[n] != state[offsets[number] + n])
					return false;
		}
		return true;
	}

	void apply(const Row &row) {
		for (size_t n = 0; n < engine.pins.size(); n++)
			engine.pins[n].set(row.levels[n]);
		engine.settled = false;
	}

	// Looks at the coils in a clock; where the machine was reset its position is 0.
	int follow(Motors &m, const Row &row) {
		int wrong = 0;
		for (int axis = 0; axis < AXES; axis++) {
			wrong = std::max(wrong, m.follow(axis, coils[axis].get()));
			if (m.cleared)
				m.origin[axis] = m.position[axis];
		}
		m.cleared = row.rst || !row.automatic;
		return wrong;
	}

	bool counts_right(const Motors &m) const {
		for (int axis = 0; axis < AXES; axis++)
			if (uint16_t(m.position[axis] - m.origin[axis]) != uint16_t(*counts[axis]))
				return false;
		return true;
	}

	bool work(int64_t patience);
	Verdict strike(
		int64_t clock, size_t number, size_t bit, int64_t window, int64_t patience, int64_t *place);
};

// Does all rows without an upset; false if the machine is wrong or never ready, which it must not be.
bool Trial::work(int64_t patience) {
	starts.clear(), row_at.clear(), states.clear(), motors.clear(), errors.clear();
	restore(power_up.data());
	Motors m;
	for (size_t number = 0; number < rows.size(); number++) {
		auto &row = rows[number];
		starts.push_back(int64_t(row_at.size()));
		apply(row);
		bool is_ready = false;
		for (int64_t elapsed = 0; elapsed < row.clocks || (row.waits && !is_ready); elapsed++) {
			engine.settle();
			if (follow(m, row) || !counts_right(m) || elapsed > row.clocks + patience)
				return false;
			row_at.push_back(int32_t(number));
			states.resize(states.size() + words);
			save(&states[states.size() - words]);
			motors.push_back(m);
			errors.push_back(uint8_t(error.get()));
			is_ready = ready.get();
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

// Says what becomes of an upset, and where the motors are then, and should be.
Verdict Trial::strike(
	int64_t clock, size_t number, size_t bit, int64_t window, int64_t patience, int64_t *place
) {
	size_t at = row_at[clock], end = row_at[clock];
	while (ends[end] >= 0 && starts[end] < clock + window)
		end = ends[end];
	restore(&states[clock * words]);
	flip(number, bit);
	Motors m = motors[clock - 1];
	int64_t elapsed = clock - starts[at], made = 0, moved = 0;
	apply(rows[at]);
	for (;; made++) {
		engine.settle();
		int64_t before[AXES];
		std::copy(m.position, m.position + AXES, before);
		bool jumped = follow(m, rows[at]) != 0;
		if (!std::equal(before, before + AXES, m.position))
			moved = made;
		int64_t length = (at + 1 < rows.size() ? starts[at + 1] : int64_t(row_at.size())) - starts[at];
		int64_t golden = starts[at] + std::min(elapsed, length - 1);
		if (error.get() && !rows[at].rst && !errors[golden])
			return VISIBLE;
		bool over = at == end;
		if (over || (elapsed < length && (made < 4 || elapsed == 0) && same(golden))) {
			bool right = !jumped && counts_right(m);
			for (int axis = 0; axis < AXES; axis++) {
				place[axis] = m.position[axis];
				place[AXES + axis] = motors[golden].position[axis];
				right &= place[axis] == place[AXES + axis];
			}
			return right ? HARMLESS : SILENT;
		}
		if (rows[at].waits && elapsed > length + patience) {
			for (int axis = 0; axis < AXES; axis++) {
				place[axis] = m.position[axis];
				place[AXES + axis] = motors[starts[end]].position[axis];
			}
			if (error.get())
				return VISIBLE;
			return counts_right(m) && made - moved > patience / 2 ? STUCK : SILENT;
		}
		bool is_ready = ready.get();
		engine.edge();
		if (++elapsed >= rows[at].clocks && (!rows[at].waits || is_ready)) {
			apply(rows[++at]);
			elapsed = 0;
		}
	}
}

}  // namespace

API Trial *faults_new(
	const char *const *counts, int32_t ready, int32_t error, const int32_t *coils, int32_t rst
) {
	auto trial = new Trial;
	for (int axis = 0; axis < AXES; axis++) {
		if (!trial->find_count(counts[axis])) {
			delete trial;
			return nullptr;
		}
		trial->coils[axis] = trial->engine.pads[coils[axis]];
	}
	trial->ready = trial->engine.pads[ready];
	trial->error = trial->engine.pads[error];
	trial->rst = trial->engine.pins[rst];
	trial->engine.settle();
	trial->power_up.resize(trial->words);
	trial->save(trial->power_up.data());
	return trial;
}

API void faults_delete(Trial *trial) { delete trial; }

// Gives the name of a register, and its width; null behind the last.
API const char *faults_register(Trial *trial, int32_t number, int64_t *width) {
	if (size_t(number) >= trial->registers.size())
		return nullptr;
	*width = int64_t(trial->registers[number].width);
	return trial->registers[number].name.c_str();
}

// Takes work to be done: of each row the levels of all inputs, clocks, and whether it waits.
API void faults_rows(
	Trial *trial, int64_t rows, const uint64_t *levels, const int64_t *clocks, const uint8_t *waits,
	int32_t rst, int32_t mode
) {
	size_t pins = trial->engine.pins.size();
	trial->rows.clear();
	for (int64_t n = 0; n < rows; n++) {
		auto row = levels + n * pins;
		trial->rows.push_back({row, clocks[n], waits[n] != 0, row[rst] != 0, row[mode] != 0});
	}
}

// Does the work without an upset; gives its clocks, or -1.
API int64_t faults_work(Trial *trial, const uint8_t *compared, int64_t patience) {
	trial->compared.clear();
	for (size_t n = 0; n < trial->registers.size(); n++)
		if (compared[n])
			trial->compared.push_back(uint32_t(n));
	return trial->work(patience) ? int64_t(trial->row_at.size()) : -1;
}

// Strikes so many times. A seed and the number of an upset say where and when. Gives how often it came
// to each verdict, register by register, and of the first silent ones number, clock, bit and places.
API int64_t faults_flips(
	Trial *trial, uint64_t seed, int64_t first, int64_t flips, int64_t window, int64_t patience,
	int64_t *verdicts, int64_t *silent, int64_t room
) {
	// Behind the last row where everything rests nobody would see what becomes of an upset.
	size_t last = 0;
	while (trial->ends[last] >= 0)
		last = trial->ends[last];
	int64_t clocks = trial->starts[last] - 1, found = 0;
	for (int64_t n = first; n < first + flips; n++) {
		uint64_t chance = mixed(mixed(seed) + uint64_t(n));
		size_t place = chance % trial->bits.size();
		size_t number = trial->bits[place];
		size_t bit = place - (std::lower_bound(trial->bits.begin(), trial->bits.end(), number)
			- trial->bits.begin());
		int64_t clock = 1 + int64_t(mixed(chance) % uint64_t(clocks - 1));
		int64_t where[2 * AXES] = {0};
		auto verdict = trial->strike(clock, number, bit, window, patience, where);
		verdicts[number * VERDICTS + verdict]++;
		if (verdict == SILENT && found < room) {
			int64_t facts[] = {int64_t(number), clock, int64_t(bit)};
			std::copy(facts, facts + 3, silent + found * 9);
			std::copy(where, where + 2 * AXES, silent + found * 9 + 3);
			found++;
		}
	}
	return found;
}

// Does the work over and over, with resets between: each after some clocks, for some. Gives what is wrong
// first (0 nothing, 1 an illegal word, 2 a jump, 3 a motor that reset moves, 4 a register that is not as
// from power-up, of those that are `set` by reset), and its clock and its axis or register.
API int32_t faults_resets(
	Trial *trial, int64_t resets, const int64_t *gaps, const int64_t *lengths, const uint8_t *set,
	int64_t *clock, int32_t *which, int64_t *steps
) {
	auto &engine = trial->engine;
	trial->restore(trial->power_up.data());
	Motors m;
	size_t at = 0;
	int64_t elapsed = 0, reset = 0, left = gaps[0];
	bool resetting = false, was_reset = false, is_new = true;
	for (*clock = 0; reset < resets; ++*clock) {
		auto &row = trial->rows[at];
		if (is_new)
			trial->apply(row);
		is_new = false;
		if (left-- == 0) {
			reset += resetting;
			resetting = !resetting;
			if (reset == resets)
				break;
			left = (resetting ? lengths : gaps)[reset] - 1;
		}
		bool rst = row.rst || resetting;
		trial->rst.set(rst);
		engine.settled = false;
		engine.settle();
		for (int axis = 0; axis < AXES; axis++) {
			int64_t before = m.position[axis];
			*which = axis;
			if (int wrong = m.follow(axis, trial->coils[axis].get()))
				return wrong;
			if (m.position[axis] != before) {
				if (was_reset)
					return 3;
				++*steps;
			}
		}
		for (size_t n = 0; was_reset && n < trial->registers.size(); n++) {
			auto &r = trial->registers[n];
			*which = int32_t(n);
			if (set[n] && !std::equal(r.curr, r.curr + r.words, &trial->power_up[trial->offsets[n]]))
				return 4;
		}
		was_reset = rst;
		bool is_ready = trial->ready.get();
		engine.edge();
		if (++elapsed >= row.clocks && (!row.waits || is_ready || elapsed > row.clocks + 2000)) {
			at = (at + 1) % trial->rows.size();
			elapsed = 0;
			is_new = true;
		}
	}
	return 0;
}
