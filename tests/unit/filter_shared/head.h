#pragma once

#include <gtest/gtest.h>

#include "engine/io/volume_io.h"
#include "tests/unit/shape_shared/itk_image.h"

namespace palpate {

using Grey = itk::Image<float, 3>;

// The head CT, on the axes of its samples and at the origin, as it is handed to ITK.
class HeadBesideItk : public testing::Test {
 protected:
    void SetUp() override {
        if (!std::filesystem::exists(kHeadCt))
            GTEST_SKIP() << kHeadCt << " is not there (invesalius-examples)";
        const Result<LoadedVolume> head = load_volume(kHeadCt);
        ASSERT_TRUE(head) << head.error().message;
        const Volume& read = head->volume;
        head_ = with_grid(read, make_grid(read.size(), spacing_mm(read.grid())));
        values_ = samples_as<float>(*head_);
        image_ = itk_image<Grey>(head_->grid(), values_);
    }

    const Volume& head() const { return *head_; }
    double span() const { return double{head_->range().max} - double{head_->range().min}; }
    double largest() const {
        return std::max(std::abs(double{head_->range().max}), std::abs(double{head_->range().min}));
    }

    std::optional<Volume> head_;
    std::vector<float> values_;
    Grey::Pointer image_;
};

} // namespace palpate
