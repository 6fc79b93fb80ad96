#include "robot/robot_table.hpp"

#include <algorithm>
#include <stdexcept>

namespace flexura {

Robot robot_of(const Table &table, int k) {
  Robot robot;
  const std::size_t at = std::size_t(k), links = std::size_t(table.links);
  const double *material = table.material + at * std::size_t(table.intervals) * MATERIAL,
               *end = material + std::size_t(table.intervals) * MATERIAL;
  const double *lump = table.lump + at * std::size_t(table.lumps) * LUMP,
               *lumps_end = lump + std::size_t(table.lumps) * LUMP;
  const double *payload = table.payload + at * PAYLOAD;
  robot.gravity[0] = table.gravity[2 * at], robot.gravity[1] = table.gravity[2 * at + 1];
  robot.payload_mass = payload[0], robot.payload_inertia = payload[1],
  robot.payload_along = payload[2], robot.payload_across = payload[3];
  robot.links.resize(links);
  for (std::size_t i = 0; i < links; ++i) {
    const std::int64_t *c = table.counts + i * COUNTS;
    const double *x = table.numbers + (at * links + i) * NUMBERS;
    Link &link = robot.links[i];
    link.joint.kind = JointKind(c[0]), link.joint.locked = c[1] != 0;
    link.elements = int(c[2]), link.modes = int(c[3]);
    link.length = x[0], link.mass = x[1], link.centre = x[2], link.inertia = x[3],
    link.alpha = x[4], link.beta = x[5];
    link.joint.angle = x[6], link.joint.start = x[7], link.joint.hub_mass = x[8],
    link.joint.hub_inertia = x[9];
    link.joint.rotor = x[10], link.joint.viscous = x[11], link.joint.coulomb = x[12],
    link.joint.low = x[13], link.joint.high = x[14], link.joint.spring = x[15],
    link.joint.rest = x[16], link.joint.hub_radius = x[17],
    link.joint.transmission_stiffness = x[18], link.joint.transmission_damping = x[19];
    link.centre_across = x[20];
    link.joint.has_hub = c[6] != 0, link.joint.elastic = (c[6] & HUB_TRANSMISSION) != 0;
    link.off_line = (c[7] & OFF_LINK) != 0;
    robot.payload_off_tip = (c[7] & OFF_PAYLOAD) != 0;
    link.lumps.resize(std::size_t(c[5]));
    for (Lump &mass : link.lumps) {
      if (lump == lumps_end) throw std::invalid_argument("there are fewer lumps than counted");
      mass = {lump[0], lump[1], lump[2]};
      lump += LUMP;
    }
    link.material.resize(std::size_t(c[4]));
    for (Interval &part : link.material) {
      if (material == end)
        throw std::invalid_argument("there are fewer rows of material than counted");
      part.from = material[0], part.to = material[1];
      std::copy_n(material + 2, 3, part.mass), std::copy_n(material + 5, 5, part.stiffness);
      material += MATERIAL;
    }
  }
  return robot;
}

}  // namespace flexura
