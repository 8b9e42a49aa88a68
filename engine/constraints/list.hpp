#pragma once
// All joints. A new one is its header and one word here.
#include <cairn/engine/constraints/angular_motor.hpp>
#include <cairn/engine/constraints/axis_alignment.hpp>
#include <cairn/engine/constraints/ball.hpp>
#include <cairn/engine/constraints/bend.hpp>
#include <cairn/engine/constraints/cone_twist.hpp>
#include <cairn/engine/constraints/distance.hpp>
#include <cairn/engine/constraints/hinge.hpp>
#include <cairn/engine/constraints/linear_motor.hpp>
#include <cairn/engine/constraints/slider.hpp>
#include <cairn/engine/constraints/spring.hpp>
#include <cairn/engine/constraints/volume.hpp>
#include <cairn/engine/constraints/weld.hpp>

#include <variant>

namespace cairn {

using JointDef = std::variant<BallDef, HingeDef, SliderDef, WeldDef, DistanceDef, ConeTwistDef, VolumeDef, BendDef,
                              AxisAlignmentDef, LinearMotorDef, AngularMotorDef, SpringDef>;

}  // namespace cairn
