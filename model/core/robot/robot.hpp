// A robot's physical constants in SI units: what the robot file says, as numbers. Nothing here is
// computed.
#pragma once
#include <vector>

namespace flexura {

enum class JointKind { revolute, slider, sleeve };  // R, Pa, Pb

struct Joint {
  JointKind kind = JointKind::revolute;
  double angle = 0.0;  // fixed angle of a slider or sleeve to the tangent it stands on [rad]
  double start = 0.0;  // position at the start [rad or m]; of a sleeve the free length
  bool locked = false;
  double hub_mass = 0.0,
         hub_inertia = 0.0;  // of a sleeve: the sleeve's own, moving with the link before
  double rotor = 0.0;        // reflected to the joint [kg m^2 or kg]
  double viscous = 0.0, coulomb = 0.0;  // [N m s/rad or N s/m], [N m or N]
  double low = 0.0, high = 0.0;         // limits [rad or m]
  double spring = 0.0, rest = 0.0;      // beside the drive [N m/rad or N/m], [rad or m]
  bool has_hub = false;                 // of a revolute joint: a radius or a transmission
  bool elastic = false;                 // a transmission between rotor and hub
  double hub_radius = 0.0;              // from the axis to where the link's line begins [m]
  double transmission_stiffness = 0.0, transmission_damping = 0.0;  // [N m/rad], [N m s/rad]
};

// Mass per length [kg/m] and bending stiffness [N m^2] on from <= s <= to as polynomials in s -
// from, lowest power first.
struct Interval {
  double from = 0.0, to = 0.0;
  double mass[3] = {0.0, 0.0, 0.0};
  double stiffness[5] = {0.0, 0.0, 0.0, 0.0, 0.0};
};

// A mass on a link's line, with its inertia about its own centre.
struct Lump {
  double at = 0.0, mass = 0.0, inertia = 0.0;  // [m], [kg], [kg m^2]
};

struct Link {
  double length = 0.0;
  int elements = 0;  // 0: rigid
  int modes = -1;    // how many of the link's own modes are kept; -1: all unknowns
  std::vector<Interval>
      material;  // of a link that bends, or of a sleeved rigid one; ascending, without gaps
  double mass = 0.0, centre = 0.0,
         inertia = 0.0;        // of a rigid link; inertia about its centre of mass
  bool off_line = false;       // whether a rigid link's centre may lie off its line
  double centre_across = 0.0;  // how far, to the left [m]
  std::vector<Lump> lumps;
  double alpha = 0.0, beta = 0.0;  // Rayleigh damping [1/s], [s]
  Joint joint;
};

struct Robot {
  double gravity[2] = {0.0, 0.0};  // [m/s^2]
  std::vector<Link> links;
  double payload_mass = 0.0, payload_inertia = 0.0;  // at the last tip; about its own centre
  bool payload_off_tip = false;                      // whether its centre may lie off the tip
  double payload_along = 0.0, payload_across = 0.0;  // from the tip, in the tip's axes [m]
};

}  // namespace flexura
