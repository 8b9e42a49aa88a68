#pragma once
// A sequence of pictures as a film.
#include <cairn/render/image.hpp>

#include <memory>

namespace cairn {

// True if the program `ffmpeg` is found on PATH.
bool filmAvailable();

// Pictures go to a file as they come: by the name's ending .mp4 (H.264), .gif, or .png for numbered pictures
// (film.png becomes film_00000.png, film_00001.png, ...), the last of which needs no other program.
class FilmWriter {
public:
    // framesPerSecond in (0, 240]; GIF players round the time of a picture to 1/100 s. InputError if the ending is none
    // of these, the file cannot be made, or a film is asked for and ffmpeg is missing.
    FilmWriter(const std::filesystem::path& file, double framesPerSecond);
    // Ends the film if finish() was not called; errors are then lost, so call finish().
    ~FilmWriter();
    FilmWriter(FilmWriter&&) noexcept;
    FilmWriter& operator=(FilmWriter&&) noexcept;

    void add(const Image& image);  // all of one size; InputError otherwise, std::runtime_error if ffmpeg gave up
    void finish();                 // std::runtime_error with ffmpeg's own words if the film could not be made
    int count() const;             // pictures so far

private:
    class Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace cairn
