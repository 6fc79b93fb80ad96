// What acts on a robot, from the rows that Python packs; how a run ended, in a word.
#include "packed.hpp"

#include <algorithm>

namespace flexura {

Signal signal_of(const Matrix &segments, std::int64_t from, std::int64_t to) {
  expect(segments.shape(1) == 10, "segments have ten numbers");
  expect(0 <= from && from <= to && std::size_t(to) <= segments.shape(0),
         "there are no such segments");
  const Segment *rows = reinterpret_cast<const Segment *>(segments.data());
  return Signal(rows + from, rows + to);
}

Inputs acting_of(const Matrix &segments, const Ranges &ranges, const Matrix &gains,
                 const Flags &prescribed, const Flags &sampled, const Matrix &limits) {
  const std::size_t joints = ranges.shape(0);
  expect(ranges.shape(1) == 4 && gains.shape(0) == joints && gains.shape(1) == 2 &&
             prescribed.shape(0) == joints && sampled.shape(0) == joints &&
             limits.shape(0) == joints && limits.shape(1) == 2,
         "drives of another shape were expected");
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

std::vector<LoadPlace> load_places_of(const Matrix &rows, int links) {
  expect(rows.shape(1) == 3, "loads of another shape were expected");
  std::vector<LoadPlace> out(rows.shape(0));
  for (std::size_t a = 0; a < out.size(); ++a) {
    const double *row = rows.data() + 3 * a;
    expect(0.0 <= row[0] && row[0] < links, "there is no such link");
    out[a].link = int(row[0]), out[a].at = row[1], out[a].follower = row[2] != 0.0;
  }
  return out;
}

void add_loads(Inputs &acting, const nb::object &loads) {
  if (loads.is_none()) return;
  const nb::tuple parts = nb::cast<nb::tuple>(loads);
  const Matrix rows = nb::cast<Matrix>(parts[0]), segments = nb::cast<Matrix>(parts[2]);
  const Ranges ranges = nb::cast<Ranges>(parts[1]);
  const std::vector<LoadPlace> places = load_places_of(rows, int(acting.joints.size()));
  expect(ranges.shape(0) == places.size() && ranges.shape(1) == 6,
         "loads of another shape were expected");
  for (std::size_t a = 0; a < places.size(); ++a) {
    PointLoad load;
    load.place = places[a];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int64_t *range = ranges.data() + 6 * a + 2 * k;
      load.value[k] = signal_of(segments, range[0], range[1]);
    }
    acting.loads.push_back(load);
  }
}

ForceFunction backlash_of(const Matrix &segments, const Matrix &rows,
                          const std::vector<int> &first) {
  expect(segments.shape(1) == 10 && rows.shape(1) == 6, "contacts of another shape were expected");
  const double most = double(segments.shape(0));
  std::vector<Backlash> contacts;
  for (std::size_t k = 0; k < rows.shape(0); ++k) {
    const double *row = rows.data() + 6 * k;
    expect(0.0 <= row[0] && row[0] < double(first.size()) && 0.0 <= row[1] && row[1] <= row[2] &&
               row[2] <= most,
           "there is no such joint or motion");
    contacts.push_back({int(row[0]),
                        signal_of(segments, std::int64_t(row[1]), std::int64_t(row[2])), row[3],
                        row[4], row[5]});
  }
  return backlash_forces(std::move(contacts), first);
}

const char *word(Status status) {
  static const char *const words[] = {"running",  "done",      "limit",      "stuck",
                                      "diverged", "exhausted", "interrupted"};
  return words[int(status)];
}

}  // namespace flexura
