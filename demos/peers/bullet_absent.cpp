// In place of bullet_peer.cpp where Bullet was not found.
#include <cairn/demos/peers/peer.hpp>

namespace cairn {

bool hasBullet() {
    return false;
}

std::unique_ptr<Peer> makeBulletPeer(const Scene&, int) {
    throw InputError("engine", "bullet", "not built in: install Bullet (Debian's libbullet-dev) and configure anew");
}

}  // namespace cairn
