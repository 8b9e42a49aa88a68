#pragma once
// The one check of a shape, whether a function of shapes.hpp has made it or a user has filled it in by hand.
#include <cairn/shapes.hpp>

#include "base/function_ref.hpp"

namespace cairn {

// The largest coefficient of friction, sliding or sticking, and arm (m) of rolling and spinning friction.
inline constexpr double roughestFriction = 1e6;

// Throws InputError for what is no shape. `where` says what messages call it, "body \"crate\".shapes[2]", and is asked
// only for a message, so that a query pays for no text. Numbers are called as the fields of Shape are.
void validate(const Shape& shape, FunctionRef<std::string()> where);

// The same for a shape that has just been made: its numbers are called as the parameters of the function that makes it.
Shape validMade(Shape shape);

// Of what a user places shapes at: finite, with a rotation of length 1.
void validate(const Posed& pose, FunctionRef<std::string()> where);

}  // namespace cairn
