// The functions that `upsets.py` calls. Above is the Trial that they are about.

API Trial *faults_new(int32_t idle, uint64_t idle_level, int32_t error, int32_t rst) {
	auto trial = new Trial;
	trial->idle = trial->engine.pads[idle];
	trial->idle_level = idle_level;
	trial->error = trial->engine.pads[error];
	trial->rst = trial->engine.pins[rst];
	trial->engine.settle();
	trial->power_up.resize(trial->words);
	trial->save(trial->power_up.data());
	trial->memory_at_power_up = trial->memory();
	return trial;
}

API void faults_delete(Trial *trial) { delete trial; }

// Adds a motor that is driven by coil words, of which it has so many, one behind the other, and by power
// if there is a pad for it, not -1; false if the machine does not count its steps under that name.
API bool faults_coils(
	Trial *trial, const char *count, int32_t coils, int32_t power, const int32_t *words, int32_t phases
) {
	Motor motor;
	motor.pads[0] = trial->engine.pads[coils];
	motor.phases = int8_t(phases);
	motor.may_be_off = power >= 0;
	if (motor.may_be_off)
		motor.pads[1] = trial->engine.pads[power];
	std::fill(motor.phase_of, motor.phase_of + 16, -1);
	for (int32_t n = 0; n < phases; n++)
		motor.phase_of[words[n]] = int8_t(n);
	if (trial->motors.size() == MOST || !trial->find_count(count, motor))
		return false;
	trial->motors.push_back(motor);
	return true;
}

// Adds one that is driven by a bit of each of STEP, DIR and ENABLE, with the times of its driver module.
API bool faults_pulses(
	Trial *trial, const char *count, const int32_t *pads, int32_t bit, const int64_t *times
) {
	Motor motor;
	for (int n = 0; n < 3; n++)
		motor.pads[n] = trial->engine.pads[pads[n]];
	motor.bit = bit;
	motor.width = times[0], motor.low = times[1], motor.setup = times[2], motor.hold = times[3];
	if (trial->motors.size() == MOST || !trial->find_count(count, motor))
		return false;
	trial->motors.push_back(motor);
	return true;
}

// Gives it a line on which it says lines that begin with these bytes, and others.
API void faults_line(Trial *trial, int32_t tx, int32_t period, const char *kinds) {
	trial->tx = trial->engine.pads[tx];
	trial->period = period;
	trial->kinds = kinds;
}

// Gives the name of a register, and its width; null behind the last.
API const char *faults_register(Trial *trial, int32_t number, int64_t *width) {
	if (size_t(number) >= trial->registers.size())
		return nullptr;
	*width = int64_t(trial->registers[number].width);
	return trial->registers[number].name.c_str();
}

// Takes work to be done: of each row the levels of all inputs, clocks, and marks: 1 where it waits, 2 where
// a session begins, 4 where there is reset, 8 where the place is called 0.
API void faults_rows(
	Trial *trial, int64_t rows, const uint64_t *levels, const int64_t *clocks, const uint8_t *marks
) {
	trial->rows = rows_of(trial->engine.pins.size(), rows, levels, clocks, marks);
}

// Takes a question likewise, how many lines of each kind are said for it, and how far each motor goes.
API void faults_question(
	Trial *trial, int64_t rows, const uint64_t *levels, const int64_t *clocks, const uint8_t *marks,
	const int64_t *answers, const int64_t *moves
) {
	trial->question = rows_of(trial->engine.pins.size(), rows, levels, clocks, marks);
	std::copy(answers, answers + KINDS, trial->answers);
	std::copy(moves, moves + trial->motors.size(), trial->moves);
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
		int64_t where[2 * MOST] = {0};
		auto verdict = trial->strike(clock, number, bit, window, patience, where);
		verdicts[number * VERDICTS + verdict]++;
		if (verdict == SILENT && found < room) {
			int64_t facts[] = {int64_t(number), clock, int64_t(bit)};
			std::copy(facts, facts + 3, silent + found * 9);
			std::copy(where, where + 2 * MOST, silent + found * 9 + 3);
			found++;
		}
	}
	return found;
}

namespace {

// The work, over and over; after a reset it goes on where it was, or with the next session, if it has any.
struct Player {
	Trial &trial;
	const std::vector<Row> *rows;
	size_t at = 0;
	int64_t elapsed = 0;
	bool is_new = true;

	const Row &row() const { return (*rows)[at]; }

	void begin(const std::vector<Row> &others, size_t place) {
		rows = &others;
		at = place;
		elapsed = 0, is_new = true;
	}

	size_t next_session() const {
		for (size_t n = 1; n <= rows->size(); n++)
			if ((*rows)[(at + n) % rows->size()].begins)
				return (at + n) % rows->size();
		return at;
	}

	// Says whether the last row is over with this clock.
	bool advance(bool was_idle, int64_t patience) {
		if (++elapsed < row().clocks || (row().waits && !was_idle && elapsed <= row().clocks + patience))
			return false;
		at = (at + 1) % rows->size();
		elapsed = 0, is_new = true;
		return at == 0;
	}
};

}  // namespace

// Does the work over and over, with resets between: each after some clocks, for some; behind those which
// `asks` says with the question instead. Gives what is wrong first, of the registers those that are `set` by
// reset, and its clock and its motor or register.
API int32_t faults_resets(
	Trial *trial, int64_t resets, const int64_t *gaps, const int64_t *lengths, const uint8_t *asks,
	const uint8_t *set, int64_t patience, int64_t *clock, int32_t *which, int64_t *steps
) {
	auto &engine = trial->engine;
	trial->restore(trial->power_up.data(), trial->memory_at_power_up);
	Player player{*trial, &trial->rows};
	Seen now, asked;
	size_t goes_on = 0;
	int64_t reset = 0, left = gaps[0];
	bool resetting = false, was_reset = false, asking = false;
	for (*clock = 0;; ++*clock) {
		if (!asking && left-- == 0) {
			reset += resetting;
			resetting = !resetting;
			if (!resetting) {
				goes_on = player.next_session();
				asking = asks[reset - 1];
				if (asking)
					player.begin(trial->question, 0);
				else if (goes_on != player.at || trial->rows[goes_on].begins)
					player.begin(trial->rows, goes_on);
				asked = now;
			}
			if (reset == resets && !asking)
				return NOTHING;
			left = resetting ? lengths[reset] - 1 : reset < resets ? gaps[reset] - 1 : 0;
		}
		if (player.is_new)
			trial->apply(player.row());
		player.is_new = false;
		bool rst = player.row().rst || resetting;
		trial->rst.set(rst);
		engine.settled = false;
		engine.settle();
		for (size_t n = 0; n < trial->motors.size(); n++) {
			auto &stand = now.stands[n];
			int64_t before = stand.position;
			*which = int32_t(n);
			if (int wrong = trial->motors[n].follow(stand))
				return wrong;
			if (stand.position != before) {
				if (was_reset)
					return MOVED;
				++*steps;
			}
		}
		trial->listen(now.said, rst);
		for (size_t n = 0; was_reset && n < trial->registers.size(); n++) {
			auto &r = trial->registers[n];
			*which = int32_t(n);
			if (set[n] && !std::equal(r.curr, r.curr + r.words, &trial->power_up[trial->offsets[n]]))
				return KEPT;
		}
		was_reset = rst;
		bool was_idle = trial->is_idle();
		engine.edge();
		if (player.advance(was_idle, patience) && asking) {
			for (int n = 0; n < KINDS; n++)
				if (now.said.lines[n] - asked.said.lines[n] != trial->answers[n])
					return DEAF;
			for (size_t n = 0; n < trial->motors.size(); n++)
				if (now.stands[n].position - asked.stands[n].position != trial->moves[n])
					return DEAF;
			if (reset == resets)
				return NOTHING;
			asking = false;
			player.begin(trial->rows, goes_on);
		}
	}
}
