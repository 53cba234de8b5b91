// Resets at any time. Above is the Trial that is reset.

namespace {

// The work, over and over; after a reset it goes on where it was, or with the next session, if it has any.
struct Runner {
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

	// Returns whether the last row is over with this clock.
	bool advance(bool was_idle, int64_t timeout) {
		if (++elapsed < row().clocks || (row().waits && !was_idle && elapsed <= row().clocks + timeout))
			return false;
		at = (at + 1) % rows->size();
		elapsed = 0, is_new = true;
		return at == 0;
	}
};

}  // namespace

// Does the work over and over, with resets between: each after some clocks, for some; after those that are
// marked in `questions` the question comes first. Gives what is wrong first, of the registers those that are
// `set` by reset, and its clock and its motor or register.
API int32_t faults_resets(
	Trial *trial, int64_t resets, const int64_t *gaps, const int64_t *lengths, const uint8_t *questions,
	const uint8_t *set, int64_t timeout, int64_t *clock, int32_t *which, int64_t *steps
) {
	auto &engine = trial->engine;
	trial->restore(trial->power_up);
	Runner runner{*trial, &trial->rows};
	Seen now, at_question;
	size_t goes_on = 0;
	int64_t reset = 0, left = gaps[0];
	bool resetting = false, was_reset = false, in_question = false;
	for (*clock = 0;; ++*clock) {
		if (!in_question && left-- == 0) {
			reset += resetting;
			resetting = !resetting;
			if (!resetting) {
				goes_on = runner.next_session();
				in_question = questions[reset - 1];
				if (in_question)
					runner.begin(trial->question, 0);
				else if (goes_on != runner.at || trial->rows[goes_on].begins)
					runner.begin(trial->rows, goes_on);
				at_question = now;
			}
			if (reset == resets && !in_question)
				return NOTHING;
			left = resetting ? lengths[reset] - 1 : reset < resets ? gaps[reset] - 1 : 0;
		}
		if (runner.is_new)
			trial->apply(runner.row());
		runner.is_new = false;
		bool rst = runner.row().rst || resetting;
		engine.put(trial->rst, rst);
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
		trial->receive(now.answers, rst);
		for (size_t n = 0; was_reset && n < trial->registers.size(); n++) {
			auto &r = trial->registers[n];
			*which = int32_t(n);
			if (set[n] && !std::equal(r.curr, r.curr + r.words, &trial->power_up[trial->offsets[n]]))
				return KEPT;
		}
		was_reset = rst;
		bool was_idle = trial->is_idle();
		engine.edge();
		if (runner.advance(was_idle, timeout) && in_question) {
			for (int n = 0; n < KINDS; n++)
				if (now.answers.lines[n] - at_question.answers.lines[n] != trial->answers[n])
					return NO_ANSWER;
			for (size_t n = 0; n < trial->motors.size(); n++)
				if (now.stands[n].position - at_question.stands[n].position != trial->moves[n])
					return NO_ANSWER;
			if (reset == resets)
				return NOTHING;
			in_question = false;
			runner.begin(trial->rows, goes_on);
		}
	}
}
