#include "haptics/sound/player.h"

#include <AL/al.h>
#include <AL/alc.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>

#include "haptics/sound/milling_sound.h"

namespace palpate::haptics {

namespace {

constexpr size_t kSamples = 512; // of a buffer: 11.6 ms
constexpr std::chrono::milliseconds kNap(3);

using Clock = std::chrono::steady_clock;

class OpenAlPlayer final : public SoundPlayer {
 public:
    OpenAlPlayer(ALCdevice* device, ALCcontext* context) : device_(device), context_(context) {
        alGenSources(1, &source_);
        alGenBuffers(kBuffers, buffers_.data());
        thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    }
    ~OpenAlPlayer() override {
        thread_.request_stop();
        thread_.join();
        alSourceStop(source_);
        alDeleteSources(1, &source_);
        alDeleteBuffers(kBuffers, buffers_.data());
        alcMakeContextCurrent(nullptr);
        alcDestroyContext(context_);
        alcCloseDevice(device_);
    }

    void set(const Milling& milling) noexcept override {
        // Each number is heard by itself; a mixture of two moments is a moment between them.
        rate_.store(milling.rate_mm3_per_s, std::memory_order_relaxed);
        hardness_.store(milling.hardness, std::memory_order_relaxed);
        speed_.store(milling.speed_mm_per_s, std::memory_order_relaxed);
        set_at_.store(Clock::now().time_since_epoch().count(), std::memory_order_release);
    }
    uint64_t buffers_played() const noexcept override { return played_; }
    void wait_until_played(uint64_t buffers) const noexcept override {
        for (uint64_t now = played_; now < buffers; now = played_)
            played_.wait(now);
    }

 private:
    Milling now() const noexcept {
        const Clock::duration at(set_at_.load(std::memory_order_acquire));
        const std::chrono::duration<double> since = Clock::now().time_since_epoch() - at;
        if (since.count() > kForget_s)
            return {};
        return {.rate_mm3_per_s = rate_.load(std::memory_order_relaxed),
                .hardness = hardness_.load(std::memory_order_relaxed),
                .speed_mm_per_s = speed_.load(std::memory_order_relaxed)};
    }
    void queue(ALuint buffer) {
        sound_.make(now(), made_);
        for (size_t i = 0; i < kSamples; ++i)
            pcm_[i] = static_cast<int16_t>(std::lround(32767.0f * made_[i]));
        alBufferData(buffer, AL_FORMAT_MONO16, pcm_.data(), sizeof(pcm_),
                     static_cast<ALsizei>(kSoundRate_hz));
        alSourceQueueBuffers(source_, 1, &buffer);
    }
    void run(const std::stop_token& stop) {
        for (const ALuint buffer : buffers_)
            queue(buffer);
        alSourcePlay(source_);
        while (!stop.stop_requested()) {
            ALint done = 0;
            alGetSourcei(source_, AL_BUFFERS_PROCESSED, &done);
            for (; done > 0; --done) {
                ALuint buffer = 0;
                alSourceUnqueueBuffers(source_, 1, &buffer);
                played_.fetch_add(1, std::memory_order_relaxed);
                played_.notify_all();
                queue(buffer);
            }
            ALint state = AL_PLAYING;
            alGetSourcei(source_, AL_SOURCE_STATE, &state);
            if (state != AL_PLAYING) // this thread came late, and the source ran dry
                alSourcePlay(source_);
            std::this_thread::sleep_for(kNap);
        }
    }

    ALCdevice* device_;
    ALCcontext* context_;
    ALuint source_ = 0;
    std::array<ALuint, kBuffers> buffers_{};
    std::atomic<double> rate_{0.0}, hardness_{0.0}, speed_{0.0};
    std::atomic<Clock::rep> set_at_{0};
    std::atomic<uint64_t> played_{0};
    // The thread's own.
    MillingSound sound_;
    std::array<float, kSamples> made_{};
    std::array<int16_t, kSamples> pcm_{};
    std::jthread thread_;
};

} // namespace

Result<std::unique_ptr<SoundPlayer>> SoundPlayer::open() {
    ALCdevice* device = alcOpenDevice(nullptr);
    if (!device)
        return fail("expected a sound output, found none that OpenAL can open");
    ALCcontext* context = alcCreateContext(device, nullptr);
    if (!context || !alcMakeContextCurrent(context)) {
        if (context)
            alcDestroyContext(context);
        alcCloseDevice(device);
        return fail("the sound output gives no OpenAL context");
    }
    return std::unique_ptr<SoundPlayer>(std::make_unique<OpenAlPlayer>(device, context));
}

} // namespace palpate::haptics
