#include "assets/input_file.hpp"

#include <cairn/input_error.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace cairn {

namespace {

class Descriptor {
public:
    // Not waited for, so that a pipe can be looked at before it is refused.
    explicit Descriptor(const std::filesystem::path& file)
        : number_(open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {}
    ~Descriptor() {
        if (number_ >= 0) {
            close(number_);
        }
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number() const { return number_; }

private:
    int number_;
};

}  // namespace

std::string readInputFile(const std::filesystem::path& file) {
    const auto fail = [&](const std::string& value, const char* remedy) {
        throw InputError(file.string(), value, remedy);
    };
    if (file.native().find('\0') != std::string::npos) {
        fail("(a name with a zero byte)", "check the path");
    }
    const Descriptor in(file);
    struct stat is {};
    if (in.number() < 0 || fstat(in.number(), &is) != 0) {
        const int error = errno;
        if (error == ENOENT || error == ENOTDIR) {
            fail("(no such file)", "check the path");
        }
        fail(std::string("(unreadable: ") + std::strerror(error) + ")", "check the file's permissions");
    }
    if (!S_ISREG(is.st_mode)) {
        fail(S_ISDIR(is.st_mode) ? "(a folder)" : "(a pipe or device)", "give a file");
    }
    std::string bytes(static_cast<std::size_t>(is.st_size), '\0');
    std::size_t done = 0;
    while (done < bytes.size()) {
        const ssize_t got = read(in.number(), bytes.data() + done, bytes.size() - done);
        if (got < 0 && errno != EINTR) {
            fail(std::string("(unreadable: ") + std::strerror(errno) + ")", "copy it anew");
        }
        if (got == 0) {
            break;
        }
        done += static_cast<std::size_t>(std::max<ssize_t>(got, 0));
    }
    bytes.resize(done);
    return bytes;
}

bool isWithin(const std::filesystem::path& folder, const std::filesystem::path& file) {
    std::error_code error;
    const auto place = [&](const std::filesystem::path& path) {
        const std::filesystem::path whole = std::filesystem::absolute(path, error);
        return error ? whole : std::filesystem::weakly_canonical(whole, error);
    };
    const std::filesystem::path above = place(folder.empty() ? "." : folder);
    if (error) {
        return false;
    }
    const std::filesystem::path below = place(file);
    return !error && std::mismatch(above.begin(), above.end(), below.begin(), below.end()).first == above.end();
}

}  // namespace cairn
