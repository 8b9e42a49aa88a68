#include "base/output_file.hpp"

#include <cairn/input_error.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

namespace cairn {

namespace {

// Its own of each file of each process, and hidden.
std::filesystem::path nameBeside(const std::filesystem::path& file) {
    static std::atomic<unsigned> count{0};
    return file.parent_path() / (".cairn_" + std::to_string(getpid()) + "_" + std::to_string(count++) + ".part");
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
    writtenTo_ = asItIs ? file_ : nameBeside(file_);
    const int made = asItIs ? O_TRUNC : O_CREAT | O_EXCL;
    const int descriptor = open(writtenTo_.c_str(), O_WRONLY | O_CLOEXEC | made, 0666);
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
    if (std::fclose(stream_.release()) != 0) {
        fail(errno);
    }
    if (beside && std::rename(writtenTo_.c_str(), file_.c_str()) != 0) {
        fail(errno);
    }
    writtenTo_ = file_;
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
