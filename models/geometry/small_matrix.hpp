// Matrices of up to eight rows whose size is set at run time. Their elements are stored in the object, so they don't
// allocate.
#pragma once

#include <Eigen/Core>

namespace proxarm::models {

constexpr int most_rows = 8;

using SmallVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, most_rows, 1>;
using SmallMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, most_rows, most_rows>;
using SmallColumns3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, most_rows, 3>;
using Mat6 = Eigen::Matrix<double, 6, 6>;

}  // namespace proxarm::models
