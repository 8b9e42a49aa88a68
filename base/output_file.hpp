#pragma once
// Files that are whole or not there at all: what is written goes to another name beside, which becomes the file's own
// when all of it is on the disk. A full disk, Ctrl-C or a crash in between leaves what was there before.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace cairn {

class OutputFile {
public:
    // `field` is what errors call the file, such as "--out". Throws InputError where no file can be made there, so make
    // it before the work whose result it takes. A link is followed; what is no file but may be written to (/dev/stdout,
    // a pipe) is written to as it is.
    OutputFile(std::string field, const std::filesystem::path& file);
    // Without finish() nothing has happened.
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    // Throws InputError with the system's reason where the disk takes no more.
    void write(std::string_view bytes);
    // Throws as write() does.
    void finish();
    // For those that write by themselves: a stream, or the other name.
    std::FILE* stream() { return stream_.get(); }
    const std::filesystem::path& writtenTo() const { return writtenTo_; }
    // Throws the error of this file for a value of errno.
    [[noreturn]] void fail(int error) const;

private:
    std::string field_;
    std::filesystem::path given_;
    std::filesystem::path file_;  // links followed
    std::filesystem::path writtenTo_;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream_{nullptr, std::fclose};
};

void writeFile(const std::string& field, const std::filesystem::path& file, std::string_view bytes);

}  // namespace cairn
