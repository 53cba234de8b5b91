// The functions that `upsets.py` calls. Above is the Trial that they are about.

API Trial *faults_new(int32_t idle, uint64_t idle_level, int32_t error, int32_t rst) {
	auto trial = new Trial;
	trial->idle = trial->engine.pads[idle];
	trial->idle_level = idle_level;
	trial->error = trial->engine.pads[error];
	trial->rst = size_t(rst);
	trial->engine.settle();
	trial->power_up = trial->state();
	return trial;
}

API void faults_delete(Trial *trial) { delete trial; }

// Adds a motor that is driven by coil words, of which it has so many, one behind the other, and by power
// if there is a pad for it, not -1; they may be off besides. The count is `first` where the position is 0.
// False if the machine does not count its steps under that name.
API bool faults_coils(
	Trial *trial, const char *count, int64_t first, int32_t coils, int32_t power, bool may_be_off,
	const int32_t *words, int32_t phases
) {
	Motor motor;
	motor.pads[0] = trial->engine.pads[coils];
	motor.phases = int8_t(phases);
	motor.first = first;
	motor.may_be_off = may_be_off;
	motor.has_power = power >= 0;
	if (motor.has_power)
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
	Trial *trial, const char *count, const int32_t *pads, const int32_t *bits, const int64_t *times
) {
	Motor motor;
	for (int n = 0; n < 3; n++)
		motor.pads[n] = trial->engine.pads[pads[n]], motor.bits[n] = bits[n];
	motor.width = times[0], motor.low = times[1], motor.setup = times[2], motor.hold = times[3];
	if (trial->motors.size() == MOST || !trial->find_count(count, motor))
		return false;
	trial->motors.push_back(motor);
	return true;
}

// Gives it a serial line; its answers begin with these bytes, other lines with others.
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

// Takes a question likewise, how many answers of each kind it has, and how far each motor goes.
API void faults_question(
	Trial *trial, int64_t rows, const uint64_t *levels, const int64_t *clocks, const uint8_t *marks,
	const int64_t *answers, const int64_t *moves
) {
	trial->question = rows_of(trial->engine.pins.size(), rows, levels, clocks, marks);
	std::copy(answers, answers + KINDS, trial->answers);
	std::copy(moves, moves + trial->motors.size(), trial->moves);
}

// Does the work without an upset; gives its clocks, or -1.
API int64_t faults_work(Trial *trial, const uint8_t *compared, int64_t timeout) {
	trial->compared.clear();
	for (size_t n = 0; n < trial->registers.size(); n++)
		if (compared[n])
			trial->compared.push_back(uint32_t(n));
	return trial->work(timeout) ? int64_t(trial->row_at.size()) : -1;
}

namespace {

// Returns the verdict of an upset, and where the motors are then, and should be.
Verdict Trial::inject(
	int64_t clock, size_t number, size_t bit, int64_t window, int64_t timeout, int64_t *place
) {
	size_t at = row_at[clock], end = row_at[clock];
	while (ends[end] >= 0 && starts[end] < clock + window)
		end = ends[end];
	restore(state_at(clock));
	flip(number, bit);
	Seen now = seen[clock - 1];
	int64_t elapsed = clock - starts[at], made = 0, moved = 0;
	apply(rows[at]);
	for (;; made++) {
		engine.settle();
		Stand before[MOST];
		std::copy(now.stands, now.stands + MOST, before);
		bool jumped = follow(now, rows[at]) != NOTHING;
		for (size_t n = 0; n < motors.size(); n++)
			if (now.stands[n].position != before[n].position)
				moved = made;
		int64_t length = (at + 1 < rows.size() ? starts[at + 1] : int64_t(row_at.size())) - starts[at];
		int64_t golden = starts[at] + std::min(elapsed, length - 1);
		if (error.get() && !rows[at].rst && !errors[golden])
			return VISIBLE;
		bool over = at == end;
		if (over || (elapsed < length && (made < 4 || elapsed == 0) && same(golden))) {
			if (compare(now, seen[golden], place) && !jumped && counts_right(now))
				return HARMLESS;
			return now.answers.same(seen[golden].answers) ? SILENT : VISIBLE;
		}
		if (rows[at].waits && elapsed > length + timeout) {
			compare(now, seen[starts[end]], place);
			if (error.get())
				return VISIBLE;
			if (counts_right(now) && made - moved > timeout / 2)
				return STUCK;
			return now.answers.same(seen[golden].answers) ? SILENT : VISIBLE;
		}
		bool was_idle = is_idle();
		engine.edge();
		if (++elapsed >= rows[at].clocks && (!rows[at].waits || was_idle)) {
			apply(rows[++at]);
			elapsed = 0;
		}
	}
}

}  // namespace

// Injects so many upsets. A seed and the number of an upset determine bit and clock. Gives how often
// there was each verdict, register by register, and of the first silent ones number, clock, bit and places.
API int64_t faults_upsets(
	Trial *trial, uint64_t seed, int64_t first, int64_t count, int64_t window, int64_t timeout,
	int64_t *verdicts, int64_t *silent, int64_t room
) {
	// After the last row where everything rests the effect of an upset would not be seen.
	size_t last = 0;
	while (trial->ends[last] >= 0)
		last = trial->ends[last];
	int64_t clocks = trial->starts[last] - 1, found = 0;
	for (int64_t n = first; n < first + count; n++) {
		uint64_t random = mixed(mixed(seed) + uint64_t(n));
		size_t place = random % trial->bits.size();
		size_t number = trial->bits[place];
		size_t bit = place - (std::lower_bound(trial->bits.begin(), trial->bits.end(), number)
			- trial->bits.begin());
		int64_t clock = 1 + int64_t(mixed(random) % uint64_t(clocks - 1));
		int64_t where[2 * MOST] = {0};
		auto verdict = trial->inject(clock, number, bit, window, timeout, where);
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
