// ffmpeg runs as a child that reads raw pictures from its standard input. That is one end of a socket pair and not of a
// pipe, because a write to a socket can be told to report a dead child instead of killing the whole program by a
// signal.
#include <cairn/render/film.hpp>

#include "base/digits.hpp"
#include "base/output_file.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <sstream>
#include <stdexcept>

extern char** environ;

namespace cairn {

namespace {

std::string findFfmpeg() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        const std::filesystem::path program = std::filesystem::path(folder.empty() ? "." : folder) / "ffmpeg";
        std::error_code error;
        if (std::filesystem::is_regular_file(program, error) && access(program.c_str(), X_OK) == 0) {
            return program.string();
        }
    }
    return {};
}

}  // namespace

bool filmAvailable() {
    return !findFfmpeg().empty();
}

class FilmWriter::Impl {
public:
    Impl(const std::filesystem::path& file, double framesPerSecond) : file_(file), rate_(framesPerSecond) {
        if (!(framesPerSecond > 0 && framesPerSecond <= 240)) {
            throw InputError("framesPerSecond", digits(framesPerSecond), "must be in (0, 240]");
        }
        ending_ = file.extension().string();
        if (ending_ != ".mp4" && ending_ != ".gif" && ending_ != ".png") {
            throw InputError("film file", file.string(), "must end in .mp4, .gif or .png (numbered pictures)");
        }
        const std::filesystem::path folder = file.parent_path();
        std::error_code error;
        if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
            throw InputError("film file", file.string(), "cannot be made: there is no folder " + folder.string());
        }
        if (ending_ == ".png") {
            return;
        }
        program_ = findFfmpeg();
        if (program_.empty()) {
            throw InputError("film file", file.string(),
                             "needs the program ffmpeg on PATH, which is not there: install it, or give a name that "
                             "ends in .png for numbered pictures");
        }
        out_ = std::make_unique<OutputFile>("film file", file_);
    }

    ~Impl() {
        if (std::uncaught_exceptions() > exceptions_) {
            abandon();  // a film that ends where its maker failed would look whole
            return;
        }
        try {
            finish();
        } catch (const std::exception&) {
            // The public destructor promises not to throw; finish() is there for who wants to know.
        }
    }
    Impl(const Impl&) = delete;
    Impl& operator=(const Impl&) = delete;

    void add(const Image& image) {
        checkImage(image, "film picture");
        if (finished_) {
            throw InputError("film picture", std::to_string(count_), "comes after finish(): start a new film");
        }
        if (count_ > 0 && (image.width != width_ || image.height != height_)) {
            throw InputError(
                "film picture", std::to_string(image.width) + " x " + std::to_string(image.height),
                "must have the size of the first, " + std::to_string(width_) + " x " + std::to_string(height_));
        }
        width_ = image.width;
        height_ = image.height;
        if (ending_ == ".png") {
            std::array<char, 32> number{};
            std::snprintf(number.data(), number.size(), "_%05d.png", count_);
            writePng(image, file_.parent_path() / (file_.stem().string() + number.data()));
        } else {
            if (child_ == 0) {
                start();
            }
            send(image.rgba);
        }
        ++count_;
    }

    void finish() {
        if (finished_) {
            return;
        }
        finished_ = true;
        if (child_ != 0) {
            end();
            out_->finish();
        }
    }

    int count() const { return count_; }

private:
    void start() {
        std::array<int, 2> ends{};
        words_.reset(std::tmpfile());
        if (words_ == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
            throw std::runtime_error(std::string("cannot start ffmpeg: ") + std::strerror(errno));
        }
        input_ = ends[0];
        const std::string size = std::to_string(width_) + "x" + std::to_string(height_);
        std::vector<std::string> words = {program_, "-hide_banner", "-loglevel",     "error", "-y",
                                          "-f",     "rawvideo",     "-pixel_format", "rgba",  "-video_size",
                                          size,     "-framerate",   digits(rate_),   "-i",    "pipe:0"};
        if (ending_ == ".gif") {
            // A palette for each picture, so that nothing waits in memory for the last one.
            words.insert(words.end(),
                         {"-filter_complex", "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1"});
        } else {
            // H.264 in the form that every player takes needs even sides.
            words.insert(words.end(),
                         {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv", "-c:v",
                          "libx264", "-preset", "medium", "-crf", "18", "-pix_fmt", "yuv420p", "-colorspace", "bt709",
                          "-color_primaries", "bt709", "-color_trc", "bt709", "-movflags", "+faststart"});
        }
        words.insert(words.end(), {"-f", ending_.substr(1), "file:" + out_->writtenTo().string()});
        std::vector<char*> arguments;
        arguments.reserve(words.size() + 1);
        for (std::string& word : words) {
            arguments.push_back(word.data());
        }
        arguments.push_back(nullptr);

        posix_spawn_file_actions_t actions;
        posix_spawn_file_actions_init(&actions);
        posix_spawn_file_actions_adddup2(&actions, ends[1], 0);
        posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
        posix_spawn_file_actions_adddup2(&actions, fileno(words_.get()), 2);
        // A group of its own: Ctrl-C is for us, who end it.
        posix_spawnattr_t attributes;
        posix_spawnattr_init(&attributes);
        posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
        const int error = posix_spawn(&child_, program_.c_str(), &actions, &attributes, arguments.data(), environ);
        posix_spawnattr_destroy(&attributes);
        posix_spawn_file_actions_destroy(&actions);
        close(ends[1]);
        if (error != 0) {
            child_ = 0;
            close(input_);
            throw std::runtime_error("cannot start " + program_ + ": " + std::strerror(error));
        }
    }

    void send(const std::vector<std::uint8_t>& bytes) {
        std::size_t done = 0;
        while (done < bytes.size()) {
            const ssize_t sent = ::send(input_, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
            if (sent < 0 && errno == EINTR) {
                continue;
            }
            if (sent <= 0) {
                finished_ = true;
                end();
                throw std::runtime_error("ffmpeg stopped reading before the end of the film " + file_.string());
            }
            done += static_cast<std::size_t>(sent);
        }
    }

    // The child's status.
    int await() {
        close(input_);
        int status = 0;
        while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
        }
        child_ = 0;
        return status;
    }

    void abandon() {
        if (child_ != 0) {
            kill(child_, SIGKILL);
            await();
        }
    }

    // Ends the child; throws its words if it failed. On a full disk it complains, but ends as if all were well.
    void end() {
        const int status = await();
        std::string said;
        std::rewind(words_.get());
        std::array<char, 512> part{};
        while (std::fgets(part.data(), static_cast<int>(part.size()), words_.get()) != nullptr) {
            said += part.data();
        }
        words_.reset();
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || !said.empty()) {
            throw std::runtime_error("ffmpeg could not make " + file_.string() + ": " + said);
        }
    }

    std::filesystem::path file_;
    double rate_;
    std::string ending_;
    std::string program_;
    int width_ = 0;
    int height_ = 0;
    int count_ = 0;
    bool finished_ = false;
    int exceptions_ = std::uncaught_exceptions();
    std::unique_ptr<OutputFile> out_;
    pid_t child_ = 0;
    int input_ = -1;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> words_{nullptr, std::fclose};  // what ffmpeg says
};

FilmWriter::FilmWriter(const std::filesystem::path& file, double framesPerSecond)
    : impl_(std::make_unique<Impl>(file, framesPerSecond)) {}
FilmWriter::~FilmWriter() = default;
FilmWriter::FilmWriter(FilmWriter&&) noexcept = default;
FilmWriter& FilmWriter::operator=(FilmWriter&&) noexcept = default;
void FilmWriter::add(const Image& image) {
    impl_->add(image);
}
void FilmWriter::finish() {
    impl_->finish();
}
int FilmWriter::count() const {
    return impl_->count();
}

}  // namespace cairn
