#include "collision/narrow_phase/fcl_nearest.hpp"
#include "collision/shapes/fcl_layout.hpp"

#include <fcl/narrowphase/detail/convexity_based_algorithm/gjk_libccd.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/box_box.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/capsule_capsule.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/halfspace.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_box.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_capsule.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_cylinder.h>
#include <fcl/narrowphase/detail/primitive_shape_algorithm/sphere_sphere.h>

#include <algorithm>
#include <stdexcept>

namespace cairn {
namespace {

using Transform = fcl::Transform3<double>;
using ContactPoints = std::vector<fcl::ContactPoint<double>>;

// FCL's capsules, cylinders and cones stand along z, ours along y.
bool standsAlongZ(ShapeKind kind) {
    return kind == ShapeKind::Capsule || kind == ShapeKind::Cylinder || kind == ShapeKind::Cone;
}

Transform transformOf(const Convex& s) {
    const Mat3d r = s.placed ? s.rotation : Mat3d(Mat3d::Identity());
    Transform t = Transform::Identity();
    if (standsAlongZ(s.kind)) {
        t.linear().col(0) = r.col(0);
        t.linear().col(1) = -r.col(2);
        t.linear().col(2) = r.col(1);
    } else {
        t.linear() = r;
    }
    t.translation() = s.placed ? s.position : Vec3d(Vec3d::Zero());
    return t;
}

ContactPoints& contactsOfThread() {
    thread_local ContactPoints contacts;
    contacts.clear();
    return contacts;
}

// Between a sphere, grown by the margin so that what is apart within it is answered too, and another shape; `contact`
// is FCL's with the sphere first.
FclAnswer ofGrownSphere(const fcl::ContactPoint<double>& contact, const Convex& sphere, double margin) {
    FclAnswer answer;
    answer.normal = -contact.normal;
    answer.separation = margin - contact.penetration_depth;
    answer.onB = sphere.position;
    answer.onA = sphere.position - (answer.separation + sphere.radius) * answer.normal;
    answer.hasPoints = true;
    return answer;
}

std::optional<FclAnswer> sphereClosedForm(const Convex& a, const Convex& sphere, double margin) {
    ContactPoints& contacts = contactsOfThread();
    const fcl::Sphere<double> grown(sphere.radius + margin);
    const Transform of = transformOf(sphere);
    const Transform other = transformOf(a);
    bool met = false;
    switch (a.kind) {
        case ShapeKind::Sphere:
            met = fcl::detail::sphereSphereIntersect(grown, of, fcl::Sphere<double>(a.radius), other, &contacts);
            break;
        case ShapeKind::Capsule:
            met = fcl::detail::sphereCapsuleIntersect(grown, of, fcl::Capsule<double>(a.radius, 2 * a.size.y()), other,
                                                      &contacts);
            break;
        case ShapeKind::Box:
            met = fcl::detail::sphereBoxIntersect(grown, of, fcl::Box<double>(Vec3d(2 * a.size)), other, &contacts);
            break;
        case ShapeKind::Cylinder:
            met = fcl::detail::sphereCylinderIntersect(grown, of, fcl::Cylinder<double>(a.size.x(), 2 * a.size.y()),
                                                       other, &contacts);
            break;
        default:
            break;
    }
    if (!met || contacts.empty()) {
        return std::nullopt;
    }
    FclAnswer answer = ofGrownSphere(contacts.front(), sphere, margin);
    if (a.radius > 0) {
        answer.onA -= a.radius * answer.normal;  // from the surface to the core
    }
    return answer;
}

std::optional<FclAnswer> capsulesClosedForm(const Convex& a, const Convex& b) {
    double distance = 0;
    Vec3d onA;
    Vec3d onB;
    fcl::detail::capsuleCapsuleDistance(fcl::Capsule<double>(a.radius, 2 * a.size.y()), transformOf(a),
                                        fcl::Capsule<double>(b.radius, 2 * b.size.y()), transformOf(b), &distance, &onA,
                                        &onB);
    // The way from surface to surface runs backwards where they overlap, and is none where they touch.
    const double ofAxes = distance + a.radius + b.radius;
    if (!(ofAxes > 1e-9 * (a.radius + b.radius)) || distance == 0) {
        return std::nullopt;
    }
    FclAnswer answer;
    answer.normal = (onB - onA) / distance;
    answer.separation = distance;
    answer.onA = onA - a.radius * answer.normal;
    answer.onB = onB + b.radius * answer.normal;
    answer.hasPoints = true;
    return answer;
}

std::optional<FclAnswer> boxesClosedForm(const Convex& a, const Convex& b) {
    ContactPoints& contacts = contactsOfThread();
    FclAnswer answer;
    double depth = 0;
    int axis = 0;
    constexpr int all = 8;  // so that none is chosen among them: they are not used
    fcl::detail::boxBox2(Vec3d(2 * a.size), transformOf(a), Vec3d(2 * b.size), transformOf(b), answer.normal, &depth,
                         &axis, all, contacts);
    if (axis == 0) {
        return std::nullopt;
    }
    answer.separation = -depth;
    if (axis > 6 && !contacts.empty()) {
        answer.onA = contacts.front().pos + 0.5 * depth * answer.normal;
        answer.onB = contacts.front().pos - 0.5 * depth * answer.normal;
        answer.hasPoints = true;
    }
    return answer;
}

// FCL's EPA has no bound; after this many supports of a shape it is ended.
constexpr int supportLimit = 200;

struct Side {
    const Convex* shape = nullptr;
    const ccd_pt_t* polytope = nullptr;  // of the search
    int hint = 0;
    int calls = 0;
};

// Whether an edge has fewer or more than two faces: FCL's EPA takes it that none has, and goes on by a null pointer, or
// by a face that the edge forgot for a third.
bool isTorn(const ccd_pt_t& polytope) {
    const ccd_pt_edge_t* edge = nullptr;
    ccdListForEachEntry(&polytope.edges, edge, const ccd_pt_edge_t, list) {
        if (edge->faces[0] == nullptr || edge->faces[1] == nullptr) {
            return true;
        }
    }
    const ccd_pt_face_t* face = nullptr;
    ccdListForEachEntry(&polytope.faces, face, const ccd_pt_face_t, list) {
        for (const ccd_pt_edge_t* side : face->edge) {
            if (side->faces[0] != face && side->faces[1] != face) {
                return true;
            }
        }
    }
    return false;
}

// Asked before the polytope is grown, and so the place to end a search that would never end, or crash.
void supportOf(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
    Side& side = *static_cast<Side*>(const_cast<void*>(object));
    if (++side.calls > supportLimit || isTorn(*side.polytope)) {
        throw std::runtime_error("no answer");
    }
    const Vec3d p = supportCore(*side.shape, Vec3d(direction->v[0], direction->v[1], direction->v[2]), side.hint);
    ccdVec3Set(out, p.x(), p.y(), p.z());
}

// Frees its faces also where FCL throws.
struct Polytope {
    ccd_pt_t faces{};
    Polytope() { ccdPtInit(&faces); }
    ~Polytope() { ccdPtDestroy(&faces); }
    Polytope(const Polytope&) = delete;
    Polytope& operator=(const Polytope&) = delete;
};

// The signed distance of the cores with its two points; false: no answer.
bool signedDistance(const Side& a, const Side& b, const ccd_t& ccd, Polytope& polytope, double& distance,
                    ccd_vec3_t& onA, ccd_vec3_t& onB) {
    namespace search = fcl::detail::libccd_extension;
    ccd_simplex_t simplex;
    if (search::__ccdGJK(&a, &b, &ccd, &simplex) != 0) {
        distance = search::_ccdDist(&a, &b, &ccd, &simplex, &onA, &onB);
        return distance > 0;
    }
    ccd_pt_el_t* nearest = nullptr;
    if (search::__ccdEPA(&a, &b, &ccd, &simplex, &polytope.faces, &nearest) != 0 || nearest == nullptr) {
        return false;
    }
    distance = -std::sqrt(nearest->dist);
    return search::penEPAPosClosest(nearest, &onA, &onB) == 0;
}

Vec3d vectorOf(const ccd_vec3_t& v) {
    return {v.v[0], v.v[1], v.v[2]};
}

}  // namespace

std::optional<FclAnswer> fclClosedForm(const Convex& a, const Convex& b, double margin) {
    if (b.kind == ShapeKind::Sphere) {
        return sphereClosedForm(a, b, margin);
    }
    if (a.kind == ShapeKind::Capsule && b.kind == ShapeKind::Capsule) {
        return capsulesClosedForm(a, b);
    }
    if (a.kind == ShapeKind::Box && b.kind == ShapeKind::Box) {
        return boxesClosedForm(a, b);
    }
    return std::nullopt;
}

std::optional<FclAnswer> fclSearch(const Convex& a, const Convex& b, double scale) {
    Polytope polytope;
    Side sideA{&a, &polytope.faces};
    Side sideB{&b, &polytope.faces};
    ccd_t ccd{};
    ccd.first_dir = ccdFirstDirDefault;
    ccd.support1 = supportOf;
    ccd.support2 = supportOf;
    ccd.max_iterations = 100;
    ccd.dist_tolerance = 1e-8 * scale;
    ccd.epa_tolerance = 1e-4 * scale;
    double distance = 0;
    ccd_vec3_t onA{};
    ccd_vec3_t onB{};
    try {
        if (!signedDistance(sideA, sideB, ccd, polytope, distance, onA, onB)) {
            return std::nullopt;
        }
    } catch (const std::exception&) {
        return std::nullopt;  // its polytope degenerated, or supportOf() ended it
    }
    FclAnswer answer;
    answer.onA = vectorOf(onA);
    answer.onB = vectorOf(onB);
    answer.hasPoints = true;
    answer.normal = (distance < 0 ? -1.0 : 1.0) * (answer.onB - answer.onA);
    const double length = answer.normal.norm();
    if (!(length > 0)) {
        return std::nullopt;
    }
    answer.normal /= length;
    answer.separation = distance - a.radius - b.radius;
    return answer;
}

std::optional<double> fclDepthInHalfSpace(const Vec3d& normal, double offset, const Convex& b, double margin) {
    ContactPoints& contacts = contactsOfThread();
    // Raised by the margin, for FCL says nothing of what is above it.
    const fcl::Halfspace<double> raised(normal, offset + margin);
    const Transform none = Transform::Identity();
    const Transform of = transformOf(b);
    bool met = false;
    switch (b.kind) {
        case ShapeKind::Sphere:
            met = fcl::detail::sphereHalfspaceIntersect(fcl::Sphere<double>(b.radius), of, raised, none, &contacts);
            break;
        case ShapeKind::Capsule:
            met = fcl::detail::capsuleHalfspaceIntersect(fcl::Capsule<double>(b.radius, 2 * b.size.y()), of, raised,
                                                         none, &contacts);
            break;
        case ShapeKind::Box:
            met = fcl::detail::boxHalfspaceIntersect(fcl::Box<double>(Vec3d(2 * b.size)), of, raised, none, &contacts);
            break;
        case ShapeKind::Cylinder:
            met = fcl::detail::cylinderHalfspaceIntersect(fcl::Cylinder<double>(b.size.x(), 2 * b.size.y()), of, raised,
                                                          none, &contacts);
            break;
        case ShapeKind::Cone:
            met = fcl::detail::coneHalfspaceIntersect(fcl::Cone<double>(b.size.x(), 2 * b.size.y()), of, raised, none,
                                                      &contacts);
            break;
        case ShapeKind::Ellipsoid:
            met = fcl::detail::ellipsoidHalfspaceIntersect(fcl::Ellipsoid<double>(b.size), of, raised, none, &contacts);
            break;
        default:
            break;
    }
    if (!met || contacts.empty()) {
        return std::nullopt;
    }
    return contacts.front().penetration_depth - margin;
}

}  // namespace cairn
