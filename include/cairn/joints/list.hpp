#pragma once
// All joints. A new one is its Def here, its rows in engine/constraints/, and one word in either list.
#include <cairn/joints/angular_motor.hpp>
#include <cairn/joints/axis_alignment.hpp>
#include <cairn/joints/ball.hpp>
#include <cairn/joints/bend.hpp>
#include <cairn/joints/cone_twist.hpp>
#include <cairn/joints/distance.hpp>
#include <cairn/joints/hinge.hpp>
#include <cairn/joints/linear_motor.hpp>
#include <cairn/joints/slider.hpp>
#include <cairn/joints/spring.hpp>
#include <cairn/joints/volume.hpp>
#include <cairn/joints/weld.hpp>

#include <variant>

namespace cairn {

using JointDef = std::variant<BallDef, HingeDef, SliderDef, WeldDef, DistanceDef, ConeTwistDef, VolumeDef, BendDef,
                              AxisAlignmentDef, LinearMotorDef, AngularMotorDef, SpringDef>;

}  // namespace cairn
