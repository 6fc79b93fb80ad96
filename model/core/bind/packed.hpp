// What acts on a robot as Python packs it, and how a run ended, in a word.
#pragma once
#include "bind.hpp"
#include "integration/run_state.hpp"

namespace flexura {

using Flags = nb::ndarray<const std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Ranges = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// Rows `from` to `to` of segments (N, 10).
Signal signal_of(const Matrix &segments, std::int64_t from, std::int64_t to);

// Drives of the joints: rows of signals, their ranges (joints, 4) [force from, to; motion from,
// to], gains (joints, 2), flags.
Inputs acting_of(const Matrix &segments, const Ranges &ranges, const Matrix &gains,
                 const Flags &prescribed, const Flags &sampled, const Matrix &limits);

// Places of loads on links from rows (L, 3): link (from 0), abscissa [m], 1 for the line's own
// axes.
std::vector<LoadPlace> load_places_of(const Matrix &rows, int links);

// Adds loads (rows, ranges, segments), or none for None: such rows, the ranges (L, 6) of their
// signals (force from, to twice, moment from, to), and the segments of these.
void add_loads(Inputs &acting, const nb::object &loads);

// What acts besides in the joints of a robot whose joints have the rows `first`: contacts behind
// backlash. segments: of their motions; rows (contacts, 6): joint (from 0), motion from, to, play,
// stiffness, damping.
ForceFunction backlash_of(const Matrix &segments, const Matrix &rows,
                          const std::vector<int> &first);

const char *word(Status status);

}  // namespace flexura
