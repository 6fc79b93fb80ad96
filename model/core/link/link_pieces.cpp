#include "link/link_pieces.hpp"

#include <algorithm>
#include <cmath>

#include "robot/input_fault.hpp"

namespace flexura {
namespace {

// A link that does not bend: one point, the line a straight rod (15).
PieceDraft rigid(double length, double mass, double centre, double about_centre) {
  PieceDraft out;
  out.m = 0, out.P = 1, out.length = length;
  out.mass = mass, out.moment = {mass * centre}, out.W = {about_centre + mass * centre * centre},
  out.w = {length};
  out.rail = 2, out.railing = 2.0,
  out.rails = {0.5, 0.5};  // w(x) = x = (P_0 + P_1)/2 at u = 2 x - 1
  return out;
}

// A mass whose centre is `along`, `across` from the hub: without length, turned to the centre
// (111).
PieceDraft off_line(double mass, double along, double across, double about_centre) {
  PieceDraft out = rigid(0.0, mass, std::hypot(along, across), about_centre);
  out.angle = std::atan2(across, along);
  return out;
}

// The hub of a revolute joint, from its axis to the beginning of the line (112); with a
// transmission behind the windup, its one unknown (109).
PieceDraft hub_piece(const Joint &joint) {
  PieceDraft out = rigid(joint.hub_radius, 0.0, 0.0, 0.0);
  if (!joint.elastic) return out;
  out.m = 1, out.B = out.tip_angle = {1.0};
  out.K = {joint.transmission_stiffness}, out.D = {joint.transmission_damping};
  return out;
}

// An element of a mesh (10), (11): the first shape x less as much of the bubble 6 x (1 - x) as
// makes K diagonal.
PieceDraft element(const Link &link, double from, double to, bool last) {
  PieceDraft out;
  out.m = 2, out.P = 3, out.beta = link.beta;
  const double h = to - from;
  double K11 = link.material[0].stiffness[0] / h, K12 = 0.0, K22 = 12.0 * K11;
  if (!uniform(link.material)) {
    K11 = K22 = 0.0;
    integrate(link.material, from, to, 5, [&](double s, double weight, double, double stiffness) {
      const double x = (s - from) / h, bubble = 6.0 * (1.0 - 2.0 * x),
                   part = weight * stiffness / (h * h);
      K11 += part, K12 += part * bubble, K22 += part * bubble * bubble;
    });
  }
  const double mix = K12 / K22;
  out.B.resize(6);
  for (std::size_t p = 0; p < 3; ++p) {
    const double x = 0.5 * (1.0 + line_rule(3).u[p]), bubble = 6.0 * x * (1.0 - x);
    out.B[p] = x - mix * bubble, out.B[3 + p] = bubble;
  }
  out.K = {K11 - mix * K12, K22}, out.tip_angle = {1.0, 0.0};
  inertia(out, link.material, from, to);
  add_lumps(out, link.lumps, from, to, last, [mix](double x, double *b) {
    const double bubble = 6.0 * x * (1.0 - x);
    b[0] = x - mix * bubble, b[1] = bubble;
  });
  return out;
}

// Where the elements of a mesh end (110): they are of equal length between the ends of the link and
// its lumps, where the curvature or its slope jumps. Lumps within a quarter of an element of an end
// or of one another get no node. As in flexura/link/line.py.
Numbers mesh_nodes(const Link &link) {
  const double length = link.length, least = 0.25 * length / link.elements;
  Numbers at, ends{0.0};
  for (const Lump &lump : link.lumps) at.push_back(lump.at);
  std::sort(at.begin(), at.end());
  for (double x : at)
    if (x - ends.back() >= least && length - x >= least && int(ends.size()) < link.elements)
      ends.push_back(x);
  ends.push_back(length);
  std::vector<int> count(ends.size() - 1, 1);
  for (int spare = link.elements - int(count.size()); spare > 0; --spare) {
    std::size_t longest = 0;
    auto element = [&](std::size_t k) { return (ends[k + 1] - ends[k]) / count[k]; };
    for (std::size_t k = 1; k < count.size(); ++k)
      if (element(k) > element(longest)) longest = k;
    ++count[longest];
  }
  Numbers out{0.0};
  for (std::size_t k = 0; k < count.size(); ++k) {
    for (int e = 1; e < count[k]; ++e)
      out.push_back(ends[k] + (ends[k + 1] - ends[k]) * e / count[k]);
    out.push_back(ends[k + 1]);
  }
  return out;
}

}  // namespace

LinkDraft begin_link(const Link &link, int index, const Attachments &attached) {
  const Joint &joint = link.joint;
  const bool sleeve = joint.kind == JointKind::sleeve, flexible = link.elements > 0;
  if (flexible && (link.material.empty() || !(link.length > 0.0)))
    throw Fault(index, "length_m",
                "expected a length above 0 and a material for a link that bends");
  if (flexible && link.modes > MOST_WHOLE - 2) throw Fault(index, "modes", "expected at most 14");
  LinkDraft out;
  if (sleeve)
    out.pieces.push_back(rigid(0.0, 0.0, 0.0, 0.0));  // the sleeve itself, fixed to the link before
  out.has_whole = flexible && (sleeve || link.modes >= 0 || attached.slider);
  if (joint.has_hub) out.pieces.push_back(hub_piece(joint));
  if (!flexible && link.off_line)
    out.pieces.push_back(off_line(link.mass, link.centre, link.centre_across, link.inertia));
  out.line = int(out.pieces.size());
  if (!flexible) {
    out.pieces.push_back(link.off_line ? rigid(link.length, 0.0, 0.0, 0.0)
                                       : rigid(link.length, link.mass, link.centre, link.inertia));
    PieceDraft &body = out.pieces.back();
    if (link.off_line) body.angle = -out.pieces[out.pieces.size() - 2].angle;
    for (const Lump &lump : link.lumps)
      add_point_mass(body, lump.mass, {lump.at}), body.W[0] += lump.inertia;
    add_payload(body, attached);
  } else if (out.has_whole) {
    out.whole = sleeve ? begin_sleeved(link, attached) : begin_single_piece(link, attached);
    out.pieces.emplace_back();
  } else {
    const Numbers nodes = mesh_nodes(link);
    for (std::size_t e = 0; e + 1 < nodes.size(); ++e)
      out.pieces.push_back(element(link, nodes[e], nodes[e + 1], e + 2 == nodes.size()));
    add_payload(out.pieces.back(), attached);
  }
  auto piece = [&](std::size_t k) -> PieceDraft & {
    return out.has_whole && k + 1 == out.pieces.size() ? out.whole.piece : out.pieces[k];
  };
  PieceDraft &base = piece(0), &moving = piece(sleeve ? 1 : 0);
  if (joint.kind != JointKind::revolute) base.angle += joint.angle;
  base.mass += joint.hub_mass;
  if (joint.elastic)
    base.W[0] += joint.hub_inertia;  // turns with the windup
  else
    base.hub += joint.hub_inertia;
  if (sleeve && !flexible) moving.offset = -link.length;
  moving.joint = joint.kind == JointKind::revolute ? HubJoint::revolute
                 : sleeve && flexible              ? HubJoint::sleeve
                                                   : HubJoint::slider;
  moving.rotor = joint.rotor;
  for (std::size_t k = 0; k < out.pieces.size(); ++k) piece(k).link = index;
  return out;
}

std::vector<PieceDraft> off_tip(const Attachments &attached, int index) {
  std::vector<PieceDraft> out;
  if (!attached.off_tip) return out;
  out.push_back(off_line(attached.payload_mass, attached.payload_along, attached.payload_across,
                         attached.payload_inertia));
  out.push_back(rigid(0.0, 0.0, 0.0, 0.0));
  out.back().angle = -out.front().angle;
  for (PieceDraft &piece : out) piece.link = index;
  return out;
}

void finish_link(LinkDraft &draft, const Link &link, const ClampedModes<double> &modes) {
  if (draft.has_whole) draft.pieces.back() = finish_single_piece(draft.whole, link, modes);
}

}  // namespace flexura
