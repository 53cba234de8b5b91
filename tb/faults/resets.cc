// Resets at any time. Above is the Trial that is reset.

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
