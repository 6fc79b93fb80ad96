#include "link/assembly.hpp"

#include <algorithm>
#include <cmath>

#include "dynamics/mass_matrix.hpp"
#include "link/link_pieces.hpp"
#include "numbers/eigenproblem.hpp"
#include "robot/input_fault.hpp"

namespace flexura {
namespace {

// Rows of `values` (rows, width), each padded to fours, into `out`.
void put(double *out, const std::vector<double> &values, int rows, int width) {
  for (int r = 0; r < rows; ++r)
    std::copy_n(values.begin() + std::ptrdiff_t(r) * width, width,
                out + std::ptrdiff_t(r) * padded(width));
}
void put(double *out, const std::vector<double> &values) {
  std::copy(values.begin(), values.end(), out);
}

// A constant piece from a draft, its arrays at `block`.
void fill_piece(Piece<double> &c, const PieceDraft &d, double *block) {
  static_cast<Shape &>(c) = d;
  c.mass = d.mass, c.hub = d.hub, c.tip = d.tip, c.angle = d.angle, c.offset = d.offset,
  c.rotor = d.rotor;
  c.length = d.length, c.railing = d.railing, c.payload = d.payload, c.beta = d.beta;
  place_arrays(c, static_cast<const double *>(block));
  auto into = [&](const double *array) { return block + (array - block); };
  const int m = d.m, P = d.P, stride = padded(m + 2);
  put(into(c.tip_angle), d.tip_angle), put(into(c.K), d.K);
  for (int i = 0; i < m; ++i)
    into(c.D)[i] = d.D.empty() ? d.beta * d.K[std::size_t(i)] : d.D[std::size_t(i)];
  for (const Spin &spin : d.spins)  // (110)
    for (int a = 0; a <= m; ++a)
      for (int b = 0; b <= m; ++b)
        into(c.spin)[a * (m + 1) + b] += spin.inertia *
                                         (a == 0 ? 1.0 : spin.b[std::size_t(a) - 1]) *
                                         (b == 0 ? 1.0 : spin.b[std::size_t(b) - 1]);
  put(into(c.B), d.B, m, P), put(into(c.w), d.w), put(into(c.rails), d.rails);
  for (int p = 0; p < P; ++p) {
    double *row = into(c.columns) + p * stride;
    row[0] = 1.0;
    for (int i = 0; i < m; ++i) row[1 + i] = d.B[std::size_t(i * P + p)];
  }
  if (d.joint == HubJoint::sleeve) {
    put(into(c.xi), d.xi), put(into(c.weight), d.weight), put(into(c.C), d.C),
        put(into(c.bend), d.bend, m, P);
    put(into(c.material), d.material);
    return;
  }
  put(into(c.moment), d.moment);
  std::vector<double> lower = d.W;  // W = L L^T = R^T R (16)
  cholesky(P, lower.data(), 4.0 * P * 0x1p-52);
  for (int p = 0; p < P; ++p)
    for (int j = p; j < P; ++j) into(c.R)[p * P + j] = lower[std::size_t(j * P + p)];
}

// Refuses a joint that moves no mass: with the others at rest nothing can be said of its
// acceleration.
void check_masses(const Model<double> &model, const Robot &robot) {
  Workspace<double> work(model);
  const std::size_t n = std::size_t(model.n), links = robot.links.size();
  std::vector<double> q(n, 0.0), zero(n, 0.0), a(n), given(links, 0.0), reaction(links);
  std::vector<char> held(model.locked);
  std::vector<double> M;  // where a link has no mass, what bends with it leaves round-off
  if (std::any_of(robot.links.begin(), robot.links.end(), [](const Link &link) {
        return link.elements > 0 && link.material[0].mass[0] == 0.0;
      }))
    M.resize(n * n);
  auto least = [&](int row) { return M.empty() ? 0.0 : 1e-14 * M[std::size_t(row) * (n + 1)]; };
  for (std::size_t i = 0; i < links; ++i) q[std::size_t(model.first[i])] = model.start[i];
  if (!M.empty()) {
    std::vector<Vec3<double>> wrench(n);
    mass_matrix(model, work, q.data(), zero.data(), wrench.data(), M.data());
  }
  const Stage<double> plain{q.data(), zero.data(), 0.0, 0.0, nullptr, nullptr};
  accelerate(model, work, q.data(), zero.data(), plain, zero.data(),
             Held<double>{held.data(), given.data(), reaction.data()}, a.data());
  for (std::size_t i = model.pieces.size(); i-- > 0;) {  // a fault spoils the pivots before it
    const Piece<double> &c = model.pieces[i];
    if (c.m > 0 && int(i) < model.line[std::size_t(c.link)]) {
      const double pivot = 1.0 / work.kept[i].inverses[0];
      if (!(pivot > 0.0) || !std::isfinite(pivot))
        throw Fault(
            c.link, "joint.transmission",
            "nothing to accelerate: expected a mass or inertia (link, hub or payload) beyond "
            "the transmission");
    }
    if (c.joint == HubJoint::none || held[std::size_t(c.link)]) continue;
    const double pivot = 1.0 / work.kept[i].inverse;
    if (!(pivot > least(c.first)) || !std::isfinite(pivot))
      throw Fault(
          c.link, "joint",
          !M.empty() && M[std::size_t(c.first) * (n + 1)] > 0.0
              ? "no inertia of its own: what it moves hangs on a link that bends and has no mass; "
                "expected an inertia or mass of the hub, a link with mass, or locked = true"
              : "nothing to accelerate: expected a mass or inertia (link, hub, rotor or payload) "
                "that this joint moves");
  }
}

// A robot in the making, link by link.
struct Blank {
  std::vector<LinkDraft> links;
  std::vector<PieceDraft> tool;  // a payload off the tip
};

void begin(const Robot &robot, Blank &out) {
  const std::size_t links = robot.links.size();
  if (links == 0) throw Fault(-1, "link", "expected a link at least");
  for (std::size_t i = 0; i < links; ++i) {
    const bool last = i + 1 == links;
    Attachments attached;
    attached.follower = !last,
    attached.slider = !last && robot.links[i + 1].joint.kind == JointKind::slider;
    if (last) {
      attached.payload_mass = robot.payload_mass, attached.payload_inertia = robot.payload_inertia;
      attached.payload_along = robot.payload_along, attached.payload_across = robot.payload_across;
      attached.off_tip = robot.payload_off_tip;
      out.tool = off_tip(attached, int(i));
    }
    out.links.push_back(begin_link(robot.links[i], int(i), attached));
  }
}

// Numbers of four robots as packs; a robot that is missing is taken for the first.
template <class Get>
std::vector<Pack<4>> side_by_side(Get get) {
  std::vector<Pack<4>> out(get(0).size());
  for (int k = 0; k < 4; ++k)
    for (std::size_t i = 0; i < out.size(); ++i) out[i].set(k, get(k)[i]);
  return out;
}

// Finishes link `index` of the robots `blanks` (1 to 4), whose modes are found together where their
// spaces are alike.
void finish_together(std::size_t index, const std::vector<Blank *> &blanks,
                     const std::vector<const Robot *> &robots) {
  auto whole = [&](int k) -> const SinglePieceLink & {
    return blanks[std::size_t(k) < blanks.size() ? std::size_t(k) : 0]->links[index].whole;
  };
  const int count = int(blanks.size());
  bool alike = count > 1 && blanks[0]->links[index].has_whole && whole(0).own;
  for (int k = 1; k < count; ++k)
    alike = alike && whole(k).clamped.m == whole(0).clamped.m && whole(k).modes == whole(0).modes;
  ClampedModes<Pack<4>> four;
  if (alike) {
    ClampedLink<Pack<4>> links;
    links.m = whole(0).clamped.m;
    links.K = side_by_side([&](int k) -> const Numbers & { return whole(k).clamped.K; });
    links.M = side_by_side([&](int k) -> const Numbers & { return whole(k).clamped.M; });
    links.deflection =
        side_by_side([&](int k) -> const Numbers & { return whole(k).clamped.deflection; });
    links.angle = side_by_side([&](int k) -> const Numbers & { return whole(k).clamped.angle; });
    four = whole(0).modes < 0 ? orthogonal_shapes(links)
                              : clamped_modes(links, whole(0).modes, whole(0).follower);
  }
  for (int k = 0; k < count; ++k) {
    LinkDraft &draft = blanks[std::size_t(k)]->links[index];
    ClampedModes<double> one;
    if (alike) {
      one.count = four.count;
      for (const Pack<4> &x : four.X) one.X.push_back(x[k]);
      for (const Pack<4> &x : four.squares) one.squares.push_back(x[k]);
    } else if (draft.has_whole && draft.whole.own) {
      const SinglePieceLink &own = draft.whole;
      one = own.modes < 0 ? orthogonal_shapes(own.clamped)
                          : clamped_modes(own.clamped, own.modes, own.follower);
    }
    finish_link(draft, robots[std::size_t(k)]->links[index], one);
  }
}

// Numbers the unknowns and puts the pieces into a model.
Model<double> numbered(const Robot &robot, Blank &blank) {
  Model<double> model;
  std::vector<PieceDraft *> drafts;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const Link &link = robot.links[i];
    model.begin.push_back(int(drafts.size()));
    model.line.push_back(int(drafts.size()) + blank.links[i].line);
    model.first.push_back(model.n);
    int elastic = 0;
    for (PieceDraft &piece : blank.links[i].pieces) {
      piece.first = model.n;
      model.n += piece.m + (piece.joint != HubJoint::none);
      elastic += piece.m;
      drafts.push_back(&piece);
    }
    model.elastic.push_back(elastic);
    model.kind.push_back(link.joint.kind), model.locked.push_back(link.joint.locked);
    model.viscous.push_back(link.joint.viscous), model.coulomb.push_back(link.joint.coulomb);
    model.spring.push_back(link.joint.spring), model.rest.push_back(link.joint.rest);
    model.alpha.push_back(link.elements > 0 ? link.alpha : 0.0),
        model.mass_damped |= model.alpha.back() != 0.0;
    model.start.push_back(link.joint.start), model.low.push_back(link.joint.low),
        model.high.push_back(link.joint.high);
  }
  model.begin.push_back(int(drafts.size()));
  for (PieceDraft &piece : blank.tool) piece.first = model.n, drafts.push_back(&piece);
  model.gravity[0] = robot.gravity[0], model.gravity[1] = robot.gravity[1];
  std::size_t size = 0;
  model.pieces.resize(drafts.size());
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    static_cast<Shape &>(model.pieces[i]) = *drafts[i];
    size += place_arrays(model.pieces[i], static_cast<const double *>(nullptr));
  }
  model.numbers.assign(size, 0.0);
  double *at = model.numbers.data();
  for (std::size_t i = 0; i < drafts.size(); ++i) {
    fill_piece(model.pieces[i], *drafts[i], at);
    at += place_arrays(model.pieces[i], static_cast<const double *>(at));
  }
  check_masses(model, robot);
  return model;
}

}  // namespace

void assemble(const Robot *const *robots, int count, Model<double> *models,
              std::unique_ptr<Fault> *faults) {
  std::vector<Blank> blanks(static_cast<std::size_t>(count));
  std::vector<Blank *> good;
  std::vector<const Robot *> of;
  for (int k = 0; k < count; ++k) {
    faults[k].reset();
    try {
      begin(*robots[k], blanks[std::size_t(k)]);
      good.push_back(&blanks[std::size_t(k)]), of.push_back(robots[k]);
    } catch (const Fault &fault) {
      faults[k] = std::make_unique<Fault>(fault);
    }
  }
  for (std::size_t i = 0; !good.empty() && i < of[0]->links.size(); ++i)
    finish_together(i, good, of);
  for (int k = 0; k < count; ++k) {
    if (faults[k]) continue;
    try {
      models[k] = numbered(*robots[k], blanks[std::size_t(k)]);
    } catch (const Fault &fault) {
      faults[k] = std::make_unique<Fault>(fault);
    }
  }
}

Model<double> assemble(const Robot &robot) {
  const Robot *one = &robot;
  Model<double> model;
  std::unique_ptr<Fault> fault;
  assemble(&one, 1, &model, &fault);
  if (fault) throw *fault;
  return model;
}

namespace {

// Models of one topology as one; number(f): the number that f takes from each.
template <class Real, class Number>
Model<Real> converted(const Model<double> &one, Number number) {
  Model<Real> out;
  out.n = one.n, out.first = one.first, out.elastic = one.elastic, out.begin = one.begin,
  out.line = one.line, out.kind = one.kind, out.locked = one.locked;
  out.start = one.start, out.low = one.low, out.high = one.high, out.mass_damped = one.mass_damped;
  for (int k = 0; k < 2; ++k)
    out.gravity[k] = number([k](const Model<double> &m) { return m.gravity[k]; });
  for (std::size_t i = 0; i < one.first.size(); ++i) {
    out.viscous.push_back(number([i](const Model<double> &m) { return m.viscous[i]; }));
    out.coulomb.push_back(number([i](const Model<double> &m) { return m.coulomb[i]; }));
    out.spring.push_back(number([i](const Model<double> &m) { return m.spring[i]; }));
    out.rest.push_back(number([i](const Model<double> &m) { return m.rest[i]; }));
    out.alpha.push_back(number([i](const Model<double> &m) { return m.alpha[i]; }));
  }
  for (std::size_t i = 0; i < one.numbers.size(); ++i)
    out.numbers.push_back(number([i](const Model<double> &m) { return m.numbers[i]; }));
  const Real *at = out.numbers.data();
  out.pieces.resize(one.pieces.size());
  for (std::size_t i = 0; i < one.pieces.size(); ++i) {
    Piece<Real> &c = out.pieces[i];
    static_cast<Shape &>(c) = one.pieces[i];
    auto take = [&](double Piece<double>::*member) {
      return number([=](const Model<double> &m) { return m.pieces[i].*member; });
    };
    c.mass = take(&Piece<double>::mass), c.hub = take(&Piece<double>::hub),
    c.tip = take(&Piece<double>::tip);
    c.angle = take(&Piece<double>::angle), c.offset = take(&Piece<double>::offset),
    c.rotor = take(&Piece<double>::rotor);
    c.length = take(&Piece<double>::length), c.railing = take(&Piece<double>::railing);
    c.payload = take(&Piece<double>::payload), c.beta = take(&Piece<double>::beta);
    at += place_arrays(c, at);
  }
  return out;
}

}  // namespace

Model<Pack<4>> pack(const Model<double> *const robots[4]) {
  return converted<Pack<4>>(*robots[0], [&](auto f) {
    Pack<4> x(0.0);
    for (int k = 0; k < 4; ++k) x.set(k, f(*robots[k]));
    return x;
  });
}

Model<Dual<4>> dual(const Model<double> &robot) {
  return converted<Dual<4>>(robot, [&](auto f) { return Dual<4>(f(robot)); });
}

}  // namespace flexura
