/// Places in a picture at which discs of a given radius may lie: Hough's transform for circles, with directions.
///
/// Every pixel on an edge votes for the point that lies one radius away on its dark side. The centre of a dark disc gets the
/// votes of its whole rim. The picture is reduced until the radius is some 8 pixels, so the cost does not grow with the radius.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "clients/track/edge_circle.hpp"

namespace kilotwin::track {

struct Candidate {
  Circle circle;     ///< in pixels of the picture that was given; the centre is good to some tenths of the radius
  double votes = 0;  ///< relative to those of an ideal disc: about 0..1
};

/// The best places, those with the most votes first, at most `most`. `grey`: 8 bits, one channel.
[[nodiscard]] std::vector<Candidate> vote(const cv::Mat& grey, double radius_px, std::size_t most = 1000);

}  // namespace kilotwin::track
