// A design that `write_cxxrtl` has written, for the loops of `loops.h`, which comes below. What depends
// on the design is above: DESIGN, its CLK, and INPUTS and OUTPUTS as lists of X(port); for waveforms VCD,
// the NAME of the design and HALF a period in nanoseconds.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#ifdef VCD
#include <cxxrtl/cxxrtl_vcd.h>
#endif
#if !defined(PASSES) || defined(VCD)
#define WHOLE // there is all of `eval`
#endif

namespace {

// A port is a value or, when a flip-flop is the port, a wire.
template<size_t N> uint32_t *pin(value<N> &port) { return port.data; }
template<size_t N> uint32_t *pin(wire<N> &port) { return port.next.data; }
template<size_t N> const uint32_t *pad(value<N> &port) { return port.data; }
template<size_t N> const uint32_t *pad(wire<N> &port) { return port.curr.data; }
template<size_t N> constexpr bool two(const value<N> &) { return N > 32; }
template<size_t N> constexpr bool two(const wire<N> &) { return N > 32; }

struct Pad {
	const uint32_t *data;
	bool two;
	uint64_t get() const { return two ? data[0] | uint64_t(data[1]) << 32 : data[0]; }
};

struct Pin {
	uint32_t *data;
	bool two;
	void set(uint64_t bits) const {
		data[0] = uint32_t(bits);
		if (two)
			data[1] = uint32_t(bits >> 32);
	}
};

struct Engine {
	DESIGN design;
	std::vector<Pin> pins;
	std::vector<Pad> pads;
	bool settled = false;
	bool touched = false; // inputs may have changed since they were looked at
#ifdef VCD
	debug_items items;
	std::unique_ptr<vcd_writer> vcd; // of the waveform that is being written, if one is
	FILE *file = nullptr;
	bool whole = true; // so far, all of it could be written
	uint64_t time = 0;
#endif

	Engine() {
#define X(port) pins.push_back({pin(design.port), two(design.port)});
		INPUTS
#undef X
#define X(port) pads.push_back({pad(design.port), two(design.port)});
		OUTPUTS
#undef X
#ifdef VCD
		design.debug_info(&items, nullptr, NAME " ");
#endif
		wake();
	}

	void put(size_t port, uint64_t bits) {
		pins[port].set(bits);
		touched = true;
		settled = false;
	}

	// After the state was changed from outside.
	void wake() {
#ifdef PASSES
		design.wake();
#endif
		settled = false;
	}

#ifdef PASSES
	void look() {
		if (std::exchange(touched, false))
			design.inputs();
	}
#endif

#ifdef WHOLE
	// Until no flip-flop, memory or loop changes any more: then the outputs are right as well.
	void step() {
		do
			design.DESIGN::eval();
		while (design.DESIGN::commit());
	}
#endif

	void settle() {
#ifdef PASSES
		if (!settled) {
			look();
			design.outputs();
		}
#else
		if (!settled)
			step();
#endif
		settled = true;
	}

	// With the one clock as the only edge, and logic that is in order, a clock is one pass over what has
	// changed: the clock need not move. Outputs wait until they are looked at.
	void edge() {
#ifdef PASSES
		if (!tracing()) {
			look();
			design.next();
			settled = false;
			wait(1);
			return;
		}
#endif
#ifdef WHOLE
		settle();
		sample();
		design.CLK.set<bool>(true);
		step();
		sample();
		design.CLK.set<bool>(false);
		step();
		wake();
		settled = true;
#endif
	}

	// Makes a clock, or a stretch of them in which these outputs stay as they are up to the last.
	int64_t advance(int64_t clocks, const std::vector<int32_t> &outputs) {
#ifdef STATE
		if (clocks >= WORTH && !tracing() && --rest <= 0) {
			if (ahead) {
				int64_t made = stretch(clocks, outputs);
				pause = made < WORTH ? std::min(2 * pause, LONGEST_REST) : REST;
				rest = pause;
				ahead.reset();
				if (made)
					return made;
			} else {
				ahead = std::make_unique<stretch::state>();
#define X(name) std::memcpy(ahead->name.curr.word, design.name.curr.data, sizeof(design.name.curr.data));
				STATE
#undef X
			}
		}
#else
		(void)clocks, (void)outputs;
#endif
		edge();
		return 1;
	}

#ifdef STATE
	// Fewer clocks than WORTH take no longer than the tries. After a stretch something happens, in some clocks.
	static constexpr int64_t WORTH = 256, REST = 6, LONGEST_REST = 2048;
	std::unique_ptr<stretch::state> ahead; // the state a clock ago, when a try is due
	int64_t rest = 0, pause = REST;

	// Takes for every register that it goes on as in the last clock; makes the clocks for which the logic
	// proves it, and returns their number; 0 if there are none.
	int64_t stretch(int64_t clocks, const std::vector<int32_t> &outputs) {
		stretch::horizon = clocks;
#define X(name) begin(ahead->name, design.name.curr);
		STATE
#undef X
#define X(name) ahead->name.rows = &design.name[0];
		MEMORIES
#undef X
#define X(name) std::memcpy(ahead->name.word, design.name.data, sizeof(design.name.data));
		INPUTS
#undef X
		ahead->pass();
		if (stretch::horizon < 2)
			return 0;
#define X(name) check(ahead->name);
		STATE
#undef X
		const bool moves[] = {
#define X(name) current(ahead->name).moves(),
			OUTPUTS
#undef X
		};
		for (auto n : outputs)
			if (moves[n])
				return 0;
		int64_t made = stretch::horizon;
		if (made < 2)
			return 0;
#define X(name) jump(design.name, ahead->name, made);
		STATE
#undef X
		wake();
		wait(made);
		return made;
	}

	template<size_t N> static void begin(stretch::wire<N> &ahead, const value<N> &now) {
		auto &curr = ahead.curr;
		auto before = curr;
		std::memcpy(curr.word, now.data, sizeof(now.data));
		if constexpr (N <= 64) {
			curr.delta = int64_t(curr.word[0] - before.word[0]);
			if (curr.delta)
				stretch::keep(curr.word[0], curr.delta, 0, stretch::wide_int(1) << N);
		} else if (std::memcmp(curr.word, before.word, sizeof(curr.word)))
			curr.delta = stretch::UNKNOWN;
		ahead.next = curr;
	}

	template<size_t N> static void check(const stretch::wire<N> &ahead) {
		auto &curr = ahead.curr, &next = ahead.next;
		bool goes_on = curr.delta != stretch::UNKNOWN && next.delta == curr.delta;
		for (size_t n = 0; n < curr.words; n++)
			goes_on &= next.word[n] == curr.word[n] + (n ? 0 : uint64_t(curr.delta));
		if (!goes_on)
			stretch::limit(0);
	}

	template<size_t N> static const stretch::value<N> &current(const stretch::value<N> &port) { return port; }
	template<size_t N> static const stretch::value<N> &current(const stretch::wire<N> &port) { return port.curr; }

	template<size_t N> static void jump(wire<N> &now, const stretch::wire<N> &ahead, int64_t clocks) {
		if (ahead.curr.moves()) {
			uint64_t bits = ahead.curr.word[0] + uint64_t(ahead.curr.delta) * uint64_t(clocks);
			std::memcpy(now.curr.data, &bits, sizeof(now.curr.data));
			now.next = now.curr;
		}
	}
#endif

#ifdef VCD
	void wait(int64_t clocks) { time += uint64_t(2 * HALF * clocks); }
	bool tracing() const { return file; }

	void sample() {
		if (tracing()) {
			vcd->sample(time);
			if (vcd->buffer.size() > 1 << 16)
				flush();
		}
		time += HALF;
	}

	void flush() {
		size_t size = vcd->buffer.size();
		whole &= fwrite(vcd->buffer.data(), 1, size, file) == size;
		vcd->buffer.clear();
	}

	// Says whether the waveform before could be written to its end, and the next can be begun.
	bool trace(const char *path) {
		if (tracing()) {
			settle();
			vcd->sample(time);
			flush();
			whole &= fclose(file) == 0;
			file = nullptr;
		}
		if (path && (file = fopen(path, "wb"))) {
			vcd = std::make_unique<vcd_writer>();
			vcd->timescale(1, "ns");
			vcd->add_without_memories(items);
		}
		return std::exchange(whole, true) && (!path || file);
	}

	~Engine() { trace(nullptr); }
#else
	void wait(int64_t) {}
	constexpr bool tracing() const { return false; }
	void sample() {}
#endif
};

}  // namespace

#define API extern "C" __attribute__((visibility("default")))

API Engine *fresa_new(const char *path) {
	auto engine = new Engine;
#ifdef VCD
	if (!engine->trace(path)) {
		delete engine;
		return nullptr;
	}
#else
	(void)path;
#endif
	return engine;
}

#ifdef VCD
// Writes a waveform from here on, or with no path stops; says whether both files can be written.
API bool fresa_trace(Engine *engine, const char *path) { return engine->trace(path); }
#endif
