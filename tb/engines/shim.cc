// A design that `write_cxxrtl` has written, for the loops of `loops.h`, which comes below. What depends
// on the design is above: DESIGN, its CLK, and INPUTS and OUTPUTS as lists of X(port); for waveforms VCD,
// the NAME of the design and HALF a period in nanoseconds.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>
#include <vector>

#ifdef VCD
#include <cxxrtl/cxxrtl_vcd.h>
#include <memory>
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
	}

	// Until no flip-flop, memory or loop changes any more: then the outputs are right as well.
	void step() {
		do
			design.DESIGN::eval();
		while (design.DESIGN::commit());
	}

	void settle() {
		if (!settled)
#ifdef PASSES
			design.outputs();
#else
			step();
#endif
		settled = true;
	}

	// With the one clock as the only edge, and logic that is in order, a clock is one pass over it: the
	// clock need not move. Outputs wait until they are looked at.
	void edge() {
#ifdef PASSES
		if (!tracing()) {
			design.next();
			settled = false;
			sample();
			sample();
			return;
		}
#endif
		settle();
		sample();
		design.CLK.set<bool>(true);
		step();
		sample();
		design.CLK.set<bool>(false);
		step();
	}

#ifdef VCD
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
