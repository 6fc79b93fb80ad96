// What acts on a robot, from the rows that Python packs; how a run ended, in a word.
#include "packed.hpp"

#include <algorithm>

namespace flexura {
namespace {

Signal signal_of(const Matrix &segments, std::int64_t from, std::int64_t to) {
  Signal out;
  for (std::int64_t k = from; k < to; ++k) {
    Segment row;
    std::copy_n(segments.data() + 10 * k, 10, reinterpret_cast<double *>(&row));
    out.push_back(row);
  }
  return out;
}

}  // namespace

Inputs acting_of(const Matrix &segments, const Ranges &ranges, const Matrix &gains,
                 const Flags &prescribed, const Flags &sampled, const Matrix &limits) {
  const std::size_t joints = ranges.shape(0);
  if (segments.shape(1) != 10 || ranges.shape(1) != 4 || gains.shape(0) != joints ||
      limits.shape(0) != joints)
    throw std::invalid_argument("drives of another shape were expected");
  Inputs acting((int(joints)));
  for (std::size_t i = 0; i < joints; ++i) {
    JointDrive &joint = acting.joints[i];
    const std::int64_t *r = ranges.data() + 4 * i;
    joint.force = signal_of(segments, r[0], r[1]), joint.motion = signal_of(segments, r[2], r[3]);
    joint.kp = gains.data()[2 * i], joint.kd = gains.data()[2 * i + 1];
    joint.prescribed = prescribed.data()[i] != 0, joint.sampled = sampled.data()[i] != 0;
    acting.limit(int(i), limits.data()[2 * i], limits.data()[2 * i + 1]);
  }
  return acting;
}

const char *word(Status status) {
  switch (status) {
    case Status::running: return "running";
    case Status::done: return "done";
    case Status::limit: return "limit";
    case Status::stuck: return "stuck";
    case Status::diverged: return "diverged";
    case Status::exhausted: return "exhausted";
    case Status::interrupted: return "interrupted";
  }
  return "";
}

}  // namespace flexura
