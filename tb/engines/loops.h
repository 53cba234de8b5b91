// The loops around a design, for ctypes, the same for every engine in C++. Above is its Engine: `put`
// for inputs, `pads` that can be got, `settled`, `settle()`, `edge()`, and `advance(clocks, outputs)`,
// which makes a clock or more of which only the last may change these outputs; and API, and fresa_new.

API void fresa_delete(Engine *engine) { delete engine; }

API void fresa_set(Engine *engine, int32_t port, uint64_t bits) {
	engine->put(port, bits);
}

API uint64_t fresa_get(Engine *engine, int32_t port) {
	engine->settle();
	return engine->pads[port].get();
}

// Gives back the clocks made, fewer than asked when the rows are full or an `until` is met.
API int64_t fresa_run(
	Engine *engine, int64_t clocks, const int32_t *watch, int32_t watched, uint64_t *last,
	const int32_t *until, const uint64_t *values, int32_t untils,
	int64_t *clock, uint64_t *rows, int64_t capacity, int64_t *used, int32_t *met
) {
	std::vector<Pad> watches, stops;
	std::vector<int32_t> outputs(watch, watch + watched);
	outputs.insert(outputs.end(), until, until + untils);
	for (int32_t n = 0; n < watched; n++)
		watches.push_back(engine->pads[watch[n]]);
	for (int32_t n = 0; n < untils; n++)
		stops.push_back(engine->pads[until[n]]);
	int64_t made = 0, row = 0;
	while (made < clocks && row < capacity && !*met) {
		// The first clock may show what inputs have changed since.
		made += engine->advance(made ? clocks - made : 1, outputs);
		if (watched || untils)
			engine->settle();
		uint64_t differs = 0;
		for (int32_t n = 0; n < watched; n++)
			differs |= watches[n].get() ^ last[n];
		if (differs) {
			for (int32_t n = 0; n < watched; n++)
				rows[n * capacity + row] = last[n] = watches[n].get();
			clock[row++] = made;
		}
		for (int32_t n = 0; n < untils; n++)
			*met |= stops[n].get() == values[n];
	}
	*used = row;
	return made;
}

// Inputs and outputs lie port after port, `rows` numbers each.
API void fresa_play(
	Engine *engine, int64_t rows, const int32_t *inputs, int32_t played, const uint64_t *stimulus,
	const int32_t *outputs, int32_t sampled, uint64_t *samples, int64_t from, int64_t to
) {
	// Columns lie a power of two apart, where a cache holds few of them: they are copied in blocks.
	constexpr int64_t BLOCK = 256;
	std::vector<uint64_t> before(played * BLOCK), after(sampled * BLOCK), differs(BLOCK), now(sampled);
	std::vector<int32_t> seen(outputs, outputs + sampled);
	for (int64_t first = from; first < to; first += BLOCK) {
		int64_t block = std::min(BLOCK, to - first);
		std::fill(differs.begin(), differs.end(), 0);
		for (int32_t n = 0; n < played; n++) {
			uint64_t *column = &before[n * BLOCK];
			std::copy_n(stimulus + n * rows + first, block, column);
			for (int64_t row = 1; row < block; row++)
				differs[row] |= column[row] ^ column[row - 1];
		}
		for (int64_t row = 0, next = 0; row < block; row = next) {
			for (int32_t n = 0; n < played && (row == 0 || differs[row]); n++)
				engine->put(inputs[n], before[n * BLOCK + row]);
			for (next = row + 1; next < block && !differs[next];)
				next++;
			engine->settle();
			for (int32_t n = 0; n < sampled; n++)
				now[n] = engine->pads[outputs[n]].get();
			next = row + engine->advance(next - row, seen);
			for (int32_t n = 0; n < sampled; n++)
				std::fill(&after[n * BLOCK + row], &after[n * BLOCK + next], now[n]);
		}
		for (int32_t n = 0; n < sampled; n++)
			std::copy_n(&after[n * BLOCK], block, samples + n * rows + first);
	}
}
