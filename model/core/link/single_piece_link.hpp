// A link as one piece: the whole link's Legendre shapes (12), its own modes in them, and a link in
// a sleeve (32).
//
// It is made in two steps, so that four robots' modes are found together: `begin_single_piece` or
// `begin_sleeved` give the piece in all its shapes and the matrices whose modes are asked for;
// `finish_single_piece` changes the shapes for the modes.
#pragma once
#include "link/clamped_modes.hpp"
#include "link/piece_draft.hpp"

namespace flexura {

struct SinglePieceLink {
  PieceDraft piece;
  bool sleeve = false, slider = false, follower = false,
       own = false;  // own: its unknowns are its own modes
  int modes = -1;
  Numbers shapes;               // (m + 1, m): of the shapes at hand, as sums of P_0 ... P_m
  int rows = 0;                 // m + 1 of the space
  ClampedLink<double> clamped;  // what `modes` are asked of, if they are
};

SinglePieceLink begin_single_piece(const Link &link, const Attachments &attached);
SinglePieceLink begin_sleeved(const Link &link, const Attachments &attached);

// The piece; `modes` as clamped_modes gives them of `clamped`, unless the link has none.
PieceDraft finish_single_piece(SinglePieceLink &whole, const Link &link,
                               const ClampedModes<double> &modes);

}  // namespace flexura
