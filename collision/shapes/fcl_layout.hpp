#pragma once
// Included by every file that sees FCL, and by no header of the module. libfcl is built for baseline SIMD: a file
// compiled with wider alignment would lay out FCL's classes otherwise and give silently wrong answers.
#include <fcl/common/types.h>

static_assert(EIGEN_MAX_STATIC_ALIGN_BYTES == 16 && alignof(fcl::Transform3<double>) == 16,
              "compile files that see FCL without -march=native, or with EIGEN_MAX_STATIC_ALIGN_BYTES=16 everywhere");
