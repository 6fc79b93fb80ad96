// The balance of energies of a run: work and losses, integrals over time that every method carries
// under the error control of the motion, against kinetic, strain and potential energy, which are
// integrals over the robot of its state alone.
#pragma once
#include "control/plant.hpp"
#include "dynamics/places/energies.hpp"

namespace flexura {

// What has come in less what is there and what has gone out, for a state z = (q, v, accounts) that
// began with the energies `begun`: 0, but for the method's error [J].
template <class Real>
Real missing_energy(const Energies<Real> &begun, const Energies<Real> &now, const Real *accounts) {
  const Real rise = (now.kinetic - begun.kinetic) + (now.strain - begun.strain) +
                    (now.potential - begun.potential);
  return accounts[WORK] - accounts[LOSS] - accounts[NUMERICAL] - rise;
}

// The same of the strain energy alone: its integral over time, (K q) . q' dt, against what the
// shape holds.
template <class Real>
Real missing_strain(const Energies<Real> &begun, const Energies<Real> &now, const Real *accounts) {
  return accounts[STRAIN] - (now.strain - begun.strain);
}

}  // namespace flexura
