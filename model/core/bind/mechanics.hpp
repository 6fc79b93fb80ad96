// A robot's equations as Python holds them.
#pragma once
#include <cstdint>
#include <memory>

#include "bind.hpp"
#include "link/assembly.hpp"
#include "robot/model.hpp"

namespace flexura {

using Counts = nb::ndarray<const std::int64_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// The physical constants of flexura/core.py's rows as a Robot.
Robot robot_of(const Vector &gravity, const Vector &payload, const Counts &counts,
               const Matrix &numbers, const Matrix &material, const Matrix &lumps);

struct Mechanics {
  std::shared_ptr<const Model<double>> model;

  Mechanics(const Vector &gravity, const Vector &payload, const Counts &counts,
            const Matrix &numbers, const Matrix &material, const Matrix &lumps)
      : model(std::make_shared<const Model<double>>(
            assemble(robot_of(gravity, payload, counts, numbers, material, lumps)))) {}
};

void add_solve(nb::class_<Mechanics> &type);  // solve.cpp

}  // namespace flexura
