// A link as one piece: the whole link's Legendre shapes (7), its own modes in them, and a link in a sleeve (8).
//
// It is made in two steps, so that four robots' modes are found together: `begin_whole` or `begin_sleeved` give the piece in all its
// shapes and the matrices whose modes are asked for; `finish_whole` changes the shapes for the modes.
#pragma once
#include "draft.hpp"
#include "own_modes.hpp"

namespace flexura {

struct WholeLink {
  Draft piece;
  bool sleeve = false, slider = false, follower = false, own = false;  // own: its unknowns are its own modes
  int modes = -1;
  Numbers shapes;            // (m + 1, m): of the shapes at hand, as sums of P_0 ... P_m
  int rows = 0;              // m + 1 of the space
  Clamped<double> clamped;   // what `modes` are asked of, if they are
};

WholeLink begin_whole(const Link &link, const Carried &carried);
WholeLink begin_sleeved(const Link &link, const Carried &carried);

// The piece; `modes` as own_modes gives them of `clamped`, unless the link has none.
Draft finish_whole(WholeLink &whole, const Link &link, const OwnModes<double> &modes);

}  // namespace flexura
