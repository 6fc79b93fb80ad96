// Planar vectors with an angle, and symmetric 3 by 3 matrices: wrenches, accelerations of a hub,
// inertias.
#pragma once

namespace flexura {

template <class Real>
struct Vec3 {  // (x, y) and what belongs to the angle: a force and a moment, or an
               // acceleration and an angular one
  Real x, y, t;
};

template <class Real>
struct Sym3 {
  Real xx, xy, xt, yy, yt, tt;
};

template <class Real>
inline Vec3<Real> operator+(const Vec3<Real> &a, const Vec3<Real> &b) {
  return {a.x + b.x, a.y + b.y, a.t + b.t};
}
template <class Real>
inline Vec3<Real> operator*(const Real &s, const Vec3<Real> &a) {
  return {s * a.x, s * a.y, s * a.t};
}
template <class Real>
inline Real dot(const Vec3<Real> &a, const Vec3<Real> &b) {
  return a.x * b.x + a.y * b.y + a.t * b.t;
}
template <class Real>
inline Vec3<Real> operator*(const Sym3<Real> &A, const Vec3<Real> &u) {
  return {A.xx * u.x + A.xy * u.y + A.xt * u.t, A.xy * u.x + A.yy * u.y + A.yt * u.t,
          A.xt * u.x + A.yt * u.y + A.tt * u.t};
}
// A -= s a a^T
template <class Real>
inline void subtract(Sym3<Real> &A, const Vec3<Real> &a, const Real &s) {
  const Vec3<Real> b = s * a;
  A.xx -= a.x * b.x, A.xy -= a.x * b.y, A.xt -= a.x * b.t, A.yy -= a.y * b.y, A.yt -= a.y * b.t,
      A.tt -= a.t * b.t;
}

}  // namespace flexura
