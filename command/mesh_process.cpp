// The process is this program again, told by its first word. What it has read, or the three parts of its error, goes to
// its standard output in the binary form of this machine.
#include "command/mesh_process.hpp"

#include <cairn/assets/mesh_file.hpp>

#include "base/digits.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <map>
#include <memory>
#include <string_view>

extern char** environ;

namespace cairn {

namespace {

constexpr std::string_view word = "read-mesh-for-parent";
constexpr const char* trust = "; if you trust it, --trusted reads it without limits";

// A sound file of a size takes about a tenth of these.
struct Limits {
    rlim_t seconds;  // of processor time
    rlim_t bytes;
};
Limits limitsFor(const std::filesystem::path& file) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    const rlim_t bytes = error ? 0 : size;
    return {10 + bytes / 1'000'000, 1'000'000'000 + 40 * bytes};
}

void limit(int what, rlim_t value) {
    const rlimit both{value, value};
    setrlimit(static_cast<__rlimit_resource>(what), &both);
}

void limitThisProcess(const Limits& limits) {
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_FSIZE, 0);
    limit(RLIMIT_CPU, limits.seconds);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    limit(RLIMIT_DATA, limits.bytes);  // sanitizers take terabytes of addresses for themselves
#endif
}

class Packer {
public:
    template <class T>
    void add(const T* values, std::size_t count) {
        bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
        bytes.append(reinterpret_cast<const char*>(values), count * sizeof(T));
    }
    void add(const std::string& text) { add(text.data(), text.size()); }
    std::string bytes;
};

// Whatever the bytes are: false where they are not what was asked for.
class Unpacker {
public:
    explicit Unpacker(std::string_view bytes) : bytes_(bytes) {}

    template <class List>
    bool take(List& values) {
        using T = typename List::value_type;
        std::size_t count = 0;
        if (bytes_.size() < sizeof count) {
            return false;
        }
        std::memcpy(&count, bytes_.data(), sizeof count);
        bytes_.remove_prefix(sizeof count);
        if (count > bytes_.size() / sizeof(T)) {
            return false;
        }
        values.resize(count);
        if (count > 0) {
            std::memcpy(static_cast<void*>(values.data()), bytes_.data(), count * sizeof(T));
        }
        bytes_.remove_prefix(count * sizeof(T));
        return true;
    }
    bool done() const { return bytes_.empty(); }

private:
    std::string_view bytes_;
};

bool isSound(const TriangleMesh& mesh) {
    for (const Vec3d& v : mesh.vertices) {
        if (!v.allFinite()) {
            return false;
        }
    }
    for (const std::array<int, 3>& triangle : mesh.triangles) {
        for (const int v : triangle) {
            if (v < 0 || static_cast<std::size_t>(v) >= mesh.vertices.size()) {
                return false;
            }
        }
    }
    return !mesh.triangles.empty();
}

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& why) {
    throw InputError(file.string(), "(not readable as a mesh)", why);
}

struct Answer {
    std::string bytes;
    int status = 0;
};

class Child {
public:
    Child(const std::filesystem::path& file, double scale) {
        std::array<int, 2> ends{};
        if (pipe2(ends.data(), O_CLOEXEC) != 0) {
            fail(file, std::string("its reader cannot be started (") + std::strerror(errno) + ")" + trust);
        }
        from_ = ends[0];
        std::array<std::string, 4> words = {"cairn", std::string(word), file.string(), digits(scale)};
        std::array<char*, 5> arguments = {words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
        posix_spawn_file_actions_addopen(&actions, 2, "/dev/null", O_WRONLY, 0);
        const int error = posix_spawn(&id_, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
        posix_spawn_file_actions_destroy(&actions);
        close(ends[1]);
        if (error != 0) {
            close(from_);
            fail(file, std::string("its reader cannot be started (") + std::strerror(error) + ")" + trust);
        }
    }
    ~Child() {
        close(from_);
        if (id_ != 0) {
            kill(id_, SIGKILL);
            wait();
        }
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    // All that it says, as far as it says no more than `most` bytes.
    Answer answer(std::size_t most) {
        Answer out;
        std::array<char, 65536> part{};
        while (out.bytes.size() <= most) {
            const ssize_t got = read(from_, part.data(), part.size());
            if (got < 0 && errno == EINTR) {
                continue;
            }
            if (got <= 0) {
                out.status = wait();
                return out;
            }
            out.bytes.append(part.data(), static_cast<std::size_t>(got));
        }
        out.status = SIGXFSZ;
        return out;
    }

private:
    int wait() {
        int status = 0;
        while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
        }
        id_ = 0;
        return status;
    }

    pid_t id_ = 0;
    int from_ = -1;
};

TriangleMesh readApart(const std::filesystem::path& file, double scale) {
    const Limits limits = limitsFor(file);
    const Answer answer = Child(file, scale).answer(limits.bytes);
    if (WIFSIGNALED(answer.status)) {
        const int signal = WTERMSIG(answer.status);
        if (signal == SIGXCPU || signal == SIGKILL) {
            fail(file, "reading it took over " + std::to_string(limits.seconds) + " s" + trust);
        }
        fail(file, std::string("its reader crashed (") + strsignal(signal) + "): it is damaged; save it anew");
    }
    Unpacker unpacker(answer.bytes);
    std::string field;
    std::string value;
    std::string remedy;
    TriangleMesh mesh;
    if (WEXITSTATUS(answer.status) == 0 && unpacker.take(mesh.vertices) && unpacker.take(mesh.triangles) &&
        unpacker.done() && isSound(mesh)) {
        return mesh;
    }
    if (WEXITSTATUS(answer.status) == 2 && unpacker.take(field) && unpacker.take(value) && unpacker.take(remedy)) {
        throw InputError(field, value, remedy);
    }
    fail(file, std::string("its reader failed") + trust);
}

void writeAll(const std::string& bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t put = write(STDOUT_FILENO, bytes.data() + done, bytes.size() - done);
        if (put < 0 && errno != EINTR) {
            return;
        }
        done += static_cast<std::size_t>(std::max<ssize_t>(put, 0));
    }
}

}  // namespace

std::function<TriangleMesh(const std::filesystem::path& file, double scale)> meshReaderApart() {
    const auto known = std::make_shared<std::map<std::pair<std::filesystem::path, double>, TriangleMesh>>();
    return [known](const std::filesystem::path& file, double scale) {
        const auto found = known->find({file, scale});
        return found != known->end() ? found->second
                                     : known->emplace(std::pair(file, scale), readApart(file, scale)).first->second;
    };
}

std::optional<int> readMeshForParent(int argc, char** argv) {
    if (argc != 4 || argv[1] != word) {
        return {};
    }
    const std::filesystem::path file = argv[2];
    limitThisProcess(limitsFor(file));
    Packer packer;
    try {
        const TriangleMesh mesh = loadMesh(file, std::stod(argv[3]));
        packer.add(mesh.vertices.data(), mesh.vertices.size());
        packer.add(mesh.triangles.data(), mesh.triangles.size());
        writeAll(packer.bytes);
        return 0;
    } catch (const InputError& error) {
        packer.add(error.field());
        packer.add(error.value());
        packer.add(error.remedy());
        writeAll(packer.bytes);
        return 2;
    }
}

}  // namespace cairn
