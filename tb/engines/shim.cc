// A design that `write_cxxrtl` has written, for the loops of `loops.h`, which comes below. What depends
// on the design is above: DESIGN, its CLK, and INPUTS and OUTPUTS as lists of X(port); for waveforms VCD,
// the NAME of the design and HALF a period in nanoseconds.

#include <cstdint>
#include <cstdio>
#include <vector>

#ifdef VCD
#include <cxxrtl/cxxrtl_vcd.h>
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
	FILE *file = nullptr;
	vcd_writer vcd;
	uint64_t time = 0;
#endif

	Engine() {
#define X(port) pins.push_back({pin(design.port), two(design.port)});
		INPUTS
#undef X
#define X(port) pads.push_back({pad(design.port), two(design.port)});
		OUTPUTS
#undef X
	}

	// Until no flip-flop, memory or loop changes any more: then the outputs are right as well.
	void step() {
		do
			design.DESIGN::eval();
		while (design.DESIGN::commit());
	}

	void settle() {
		if (!settled)
			step();
		settled = true;
	}

	// With the one clock as the only edge, what the rising edge changed settles in the falling phase.
	void edge() {
		settle();
		sample();
		design.CLK.set<bool>(true);
#if defined(ONE_EDGE) && !defined(VCD)
		design.DESIGN::eval();
		design.DESIGN::commit();
#else
		step();
#endif
		sample();
		design.CLK.set<bool>(false);
		step();
	}

#ifdef VCD
	void sample() {
		vcd.sample(time);
		time += HALF;
		if (vcd.buffer.size() > 1 << 16)
			flush();
	}

	void flush() {
		fwrite(vcd.buffer.data(), 1, vcd.buffer.size(), file);
		vcd.buffer.clear();
	}

	~Engine() {
		if (file) {
			settle();
			sample();
			flush();
			fclose(file);
		}
	}
#else
	void sample() {}
#endif
};

}  // namespace

#define API extern "C" __attribute__((visibility("default")))

API Engine *fresa_new(const char *path) {
	auto engine = new Engine;
#ifdef VCD
	engine->file = fopen(path, "wb");
	if (!engine->file) {
		delete engine;
		return nullptr;
	}
	debug_items items;
	engine->design.debug_info(&items, nullptr, NAME " ");
	engine->vcd.timescale(1, "ns");
	engine->vcd.add_without_memories(items);
#else
	(void)path;
#endif
	return engine;
}
