// One link as pieces: points, shapes, and the constants of (9), (14) and (16).
#pragma once
#include "link/single_piece_link.hpp"

namespace flexura {

// A link in the making: its pieces from its joint to its tip. If `has_whole`, the last of them is
// still `whole`, whose modes are to be found: of one robot, or of four at once.
struct LinkDraft {
  std::vector<PieceDraft> pieces;
  bool has_whole = false;
  int line = 0;  // the first piece of the link's line
  SinglePieceLink whole;
};

// The pieces of link `index` (from 0), all but the modes. Throws Fault.
LinkDraft begin_link(const Link &link, int index, const Attachments &attached);

// The payload as pieces of its own, if its centre is off the tip (111).
std::vector<PieceDraft> off_tip(const Attachments &attached, int index);

// Changes the last piece's shapes for its modes, if it has any.
void finish_link(LinkDraft &draft, const Link &link, const ClampedModes<double> &modes);

}  // namespace flexura
