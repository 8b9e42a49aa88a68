#include "base/output_file.hpp"

#include <cairn/input_error.hpp>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>

namespace cairn {

namespace {

constexpr std::string_view beginning = ".cairn_";
constexpr std::string_view ending = ".part";

// Its own of each file of each process, and hidden.
std::filesystem::path nameBeside(const std::filesystem::path& file) {
    static std::atomic<unsigned> count{0};
    std::string name(beginning);
    name += std::to_string(getpid()) + "_" + std::to_string(count++);
    return file.parent_path() / name.append(ending);
}

bool isNameBeside(std::string_view name) {
    if (!name.starts_with(beginning) || !name.ends_with(ending) || name.size() < beginning.size() + ending.size()) {
        return false;
    }
    name = name.substr(beginning.size(), name.size() - beginning.size() - ending.size());
    return std::all_of(name.begin(), name.end(), [](char c) { return (c >= '0' && c <= '9') || c == '_'; });
}

// Who writes a file holds its lock, which the system takes from the dead, however they died. A process number would not
// do: that of a process in another container, or on another machine that shares the disk, is nobody's here.
void removeLeftover(const std::filesystem::path& file) {
    // No link, and no pipe that waits for a reader. For writing, as disks of other machines lock nothing else.
    const int descriptor = open(file.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (descriptor < 0) {
        return;
    }
    struct stat found {};
    if (fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode) && flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
        unlink(file.c_str());
    }
    close(descriptor);
}

// What killed programs have left in the folder. Once for each folder: who writes pictures by the thousand does not look
// through all of them for every next.
void removeLeftovers(const std::filesystem::path& folder) {
    static std::mutex mutex;
    static std::set<std::filesystem::path> seen;
    std::error_code error;
    const std::filesystem::path whole = std::filesystem::absolute(folder.empty() ? "." : folder, error);
    if (error) {
        return;
    }
    {
        const std::lock_guard lock(mutex);
        if (!seen.insert(whole).second) {
            return;
        }
    }
    std::filesystem::directory_iterator at(whole, error);
    for (; !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
        if (isNameBeside(at->path().filename().native())) {
            removeLeftover(at->path());
        }
    }
}

// A new file beside `file`, locked; -1 with errno where none can be made.
int openBeside(const std::filesystem::path& file, std::filesystem::path& name) {
    constexpr int mostTries = 100;
    for (int tries = 0; tries < mostTries; ++tries) {
        name = nameBeside(file);
        const int descriptor = open(name.c_str(), O_WRONLY | O_CLOEXEC | O_CREAT | O_EXCL, 0666);
        if (descriptor < 0) {
            // A name that a dead process of our number has left, and that we may not remove.
            if (errno == EEXIST) {
                continue;
            }
            return -1;
        }
        const bool isLocked = flock(descriptor, LOCK_EX | LOCK_NB) == 0;
        const bool isTaken = !isLocked && errno == EWOULDBLOCK;
        struct stat made {};
        if (!isTaken && fstat(descriptor, &made) == 0 && made.st_nlink > 0) {
            return descriptor;  // without a lock where the disk knows none: nobody else gets one there either
        }
        // Who looked for leftovers between our two calls has taken it for one, and removes it.
        close(descriptor);
    }
    errno = EEXIST;
    return -1;
}

const char* remedyFor(int error) {
    switch (error) {
        case ENOENT:
        case ENOTDIR:
            return "make the folder first";
        case EACCES:
        case EPERM:
        case EROFS:
            return "give a place that you may write to";
        case ENOSPC:
        case EDQUOT:
        case EFBIG:
            return "make room, or give another disk";
        default:
            return "give another file";
    }
}

}  // namespace

OutputFile::OutputFile(std::string field, const std::filesystem::path& file)
    : field_(std::move(field)), given_(file), file_(file) {
    std::error_code error;
    if (file.native().find('\0') != std::string::npos) {
        fail(EINVAL);
    }
    for (int links = 0; std::filesystem::is_symlink(file_, error); ++links) {
        file_ = file_.parent_path() / std::filesystem::read_symlink(file_, error);
        if (error || links > 40) {
            fail(error ? error.value() : ELOOP);
        }
    }
    struct stat before {};
    const bool there = stat(file_.c_str(), &before) == 0;
    if (there && S_ISDIR(before.st_mode)) {
        fail(EISDIR);
    }
    if (there && access(file_.c_str(), W_OK) != 0) {
        fail(errno);
    }
    const bool asItIs = there && !S_ISREG(before.st_mode);
    int descriptor = -1;
    if (asItIs) {
        writtenTo_ = file_;
        descriptor = open(writtenTo_.c_str(), O_WRONLY | O_CLOEXEC | O_TRUNC);
    } else {
        removeLeftovers(file_.parent_path());
        descriptor = openBeside(file_, writtenTo_);
    }
    if (descriptor < 0) {
        fail(errno);
    }
    if (there && !asItIs) {
        fchmod(descriptor, before.st_mode & 07777);
    }
    stream_.reset(fdopen(descriptor, "wb"));
    if (stream_ == nullptr) {
        fail(errno);
    }
}

OutputFile::~OutputFile() {
    stream_.reset();
    if (writtenTo_ != file_) {
        std::error_code ignored;
        std::filesystem::remove(writtenTo_, ignored);
    }
}

void OutputFile::write(std::string_view bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), stream_.get()) != bytes.size()) {
        fail(errno);
    }
}

void OutputFile::finish() {
    if (std::fflush(stream_.get()) != 0) {
        fail(errno);
    }
    const bool beside = writtenTo_ != file_;
    if (beside && fsync(fileno(stream_.get())) != 0) {
        fail(errno);
    }
    // Before it is closed: with the file the lock goes, and without that it is a leftover.
    if (beside && std::rename(writtenTo_.c_str(), file_.c_str()) != 0) {
        fail(errno);
    }
    writtenTo_ = file_;
    if (std::fclose(stream_.release()) != 0) {
        fail(errno);
    }
}

void OutputFile::fail(int error) const {
    throw InputError(field_, given_.string(),
                     std::string("it cannot be written (") + std::strerror(error) + "): " + remedyFor(error));
}

void writeFile(const std::string& field, const std::filesystem::path& file, std::string_view bytes) {
    OutputFile out(field, file);
    out.write(bytes);
    out.finish();
}

}  // namespace cairn
