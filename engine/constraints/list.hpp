#pragma once
// The rows of all joints.
#include "engine/constraints/angular_motor.hpp"
#include "engine/constraints/axis_alignment.hpp"
#include "engine/constraints/ball.hpp"
#include "engine/constraints/bend.hpp"
#include "engine/constraints/cone_twist.hpp"
#include "engine/constraints/distance.hpp"
#include "engine/constraints/hinge.hpp"
#include "engine/constraints/linear_motor.hpp"
#include "engine/constraints/slider.hpp"
#include "engine/constraints/spring.hpp"
#include "engine/constraints/volume.hpp"
#include "engine/constraints/weld.hpp"
