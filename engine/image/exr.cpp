#include "engine/image/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <stdexcept>

#include "engine/base/file.h"
#include "engine/image/exr_header.h"

namespace palpate {

namespace {

class MemoryInput : public Imf::IStream {
 public:
    MemoryInput(const char* name, std::string_view bytes) : IStream(name), bytes_(bytes) {}

    bool read(char* out, int count) override {
        if (count < 0 || static_cast<uint64_t>(count) > bytes_.size() - position_)
            throw std::runtime_error(fmt::format("the file ends after {} bytes", bytes_.size()));
        std::memcpy(out, bytes_.data() + position_, static_cast<size_t>(count));
        position_ += static_cast<size_t>(count);
        return position_ < bytes_.size();
    }
    uint64_t tellg() override { return position_; }
    void seekg(uint64_t position) override {
        if (position > bytes_.size())
            throw std::runtime_error(fmt::format("the file ends after {} bytes", bytes_.size()));
        position_ = position;
    }

 private:
    std::string_view bytes_;
    uint64_t position_ = 0;
};

class MemoryOutput : public Imf::OStream {
 public:
    explicit MemoryOutput(const char* name) : OStream(name) {}

    void write(const char* bytes, int count) override {
        const size_t end = position_ + static_cast<size_t>(count);
        bytes_.resize(std::max(bytes_.size(), end));
        std::memcpy(bytes_.data() + position_, bytes, static_cast<size_t>(count));
        position_ = end;
    }
    uint64_t tellp() override { return position_; }
    void seekp(uint64_t position) override { position_ = position; }

    std::span<const std::byte> bytes() const { return bytes_; }

 private:
    std::vector<std::byte> bytes_;
    uint64_t position_ = 0;
};

// Half samples of an image, with the channels side by side as they are.
std::vector<Imath::half> to_half(const std::vector<float>& samples) {
    std::vector<Imath::half> out;
    out.reserve(samples.size());
    for (const float sample : samples)
        out.emplace_back(sample);
    return out;
}

// A frame buffer's slice for channel `channel` of samples that lie pixel by pixel.
template <class Sample>
Imf::Slice slice_of(Imf::PixelType type, const Sample* samples, const Imath::Box2i& window,
                    size_t channel, size_t channels) {
    const size_t width = static_cast<size_t>(window.max.x - window.min.x) + 1;
    const size_t pixel = channels * sizeof(Sample);
    return Imf::Slice::Make(type, samples + channel, window, pixel, pixel * width);
}

// R, G, B, A, then the others by name.
std::vector<std::string> channel_order(const Imf::ChannelList& list) {
    std::vector<std::string> order;
    for (const char* name : {"R", "G", "B", "A"})
        if (list.findChannel(name))
            order.emplace_back(name);
    const size_t colours = order.size();
    for (auto it = list.begin(); it != list.end(); ++it)
        if (const auto end = order.begin() + static_cast<ptrdiff_t>(colours);
            std::find(order.begin(), end, it.name()) == end)
            order.emplace_back(it.name());
    return order;
}

ExrFile read(const std::filesystem::path& path, std::string_view bytes) {
    MemoryInput stream(path.c_str(), bytes);
    Imf::InputFile file(stream, /*numThreads=*/0);
    const Imf::Header& header = file.header();
    const Imath::Box2i window = header.dataWindow();
    ExrFile out;
    out.image = make_image({window.max.x - window.min.x + 1, window.max.y - window.min.y + 1},
                           channel_order(header.channels()));
    const size_t channels = out.image.channels.size();
    Imf::FrameBuffer frame;
    for (size_t c = 0; c < channels; ++c) {
        const Imf::Channel& stored = header.channels()[out.image.channels[c]];
        if (stored.xSampling != 1 || stored.ySampling != 1)
            throw std::runtime_error(
                fmt::format("expected channels at full resolution, found {} subsampled {} x {}",
                            out.image.channels[c], stored.xSampling, stored.ySampling));
        frame.insert(out.image.channels[c],
                     slice_of(Imf::FLOAT, out.image.samples.data(), window, c, channels));
    }
    for (auto it = header.begin(); it != header.end(); ++it)
        if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute()))
            out.metadata.emplace(it.name(), text->value());
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return out;
}

void write(MemoryOutput& stream, const Image& image, ExrPrecision precision,
           const ImageMetadata& metadata) {
    const Imf::PixelType type = precision == ExrPrecision::half_float ? Imf::HALF : Imf::FLOAT;
    Imf::Header header(static_cast<int>(image.size_px.x), static_cast<int>(image.size_px.y));
    header.compression() = Imf::ZIP_COMPRESSION;
    for (const auto& [key, text] : metadata)
        header.insert(key, Imf::StringAttribute(text));
    const std::vector<Imath::half> halves =
        type == Imf::HALF ? to_half(image.samples) : std::vector<Imath::half>{};
    Imf::FrameBuffer frame;
    const size_t channels = image.channels.size();
    for (size_t c = 0; c < channels; ++c) {
        header.channels().insert(image.channels[c], Imf::Channel(type));
        frame.insert(image.channels[c],
                     type == Imf::HALF
                         ? slice_of(type, halves.data(), header.dataWindow(), c, channels)
                         : slice_of(type, image.samples.data(), header.dataWindow(), c, channels));
    }
    Imf::OutputFile file(stream, header, /*numThreads=*/0);
    file.setFrameBuffer(frame);
    file.writePixels(static_cast<int>(image.size_px.y));
}

// OpenEXR's own sentences, in one line and without a final full stop.
std::string one_line(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (!text.empty() && (text.back() == '.' || text.back() == ' '))
        text.pop_back();
    return text;
}

} // namespace

Result<void> save_exr(const std::filesystem::path& path, const Image& image, ExrPrecision precision,
                      const ImageMetadata& metadata) {
    if (const size_t whole = size_t{image.size_px.x} * image.size_px.y * image.channels.size();
        image.samples.size() != whole)
        return fail("{}: expected a picture of {} samples, found {}", path.string(), whole,
                    image.samples.size());
    PALPATE_TRY(check_image_limits(path, image.size_px.x, image.size_px.y, image.channels.size()));
    MemoryOutput stream(path.c_str());
    try {
        write(stream, image, precision, metadata);
    } catch (const std::exception& error) {
        return fail("{}: cannot be written: {}", path.string(), one_line(error.what()));
    }
    return save_bytes(path, stream.bytes());
}

Result<ExrFile> load_exr(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string bytes, load_text(path, 2 * kMaxImageBytes));
    PALPATE_TRY(check_exr_header(path, bytes));
    try {
        return read(path, bytes);
    } catch (const std::exception& error) {
        return fail("{}: cannot be read: {}", path.string(), one_line(error.what()));
    }
}

} // namespace palpate
