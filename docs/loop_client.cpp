// A client of `spin-usd serve` in C++: it approaches the target, and counts the pixels that show it.
//
// c++ -std=c++17 -DMSGPACK_NO_BOOST docs/loop_client.cpp -lzmq && ./a.out [ADDRESS], with cppzmq and msgpack-cxx.

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <msgpack.hpp>
#include <zmq.hpp>

using Map = std::map<std::string, msgpack::object>;

int main(int count, char** words) {
    zmq::context_t context;
    zmq::socket_t socket(context, zmq::socket_type::req);
    socket.connect(count > 1 ? words[1] : "tcp://127.0.0.1:8644");
    for (int step = 0; step < 20; ++step) {
        const double half = 0.02 * step, distance = 8.0 - 0.2 * step;
        const std::array<double, 4> q = {std::cos(half), 0.0, std::sin(half), 0.0};  // T_cam_body, scalar first
        const std::array<double, 3> t = {0.0, 0.0, distance};                        // metres
        msgpack::sbuffer asked;
        msgpack::packer<msgpack::sbuffer> pack(asked);
        pack.pack_map(2);
        pack.pack("pose").pack(std::make_tuple(q, t));
        pack.pack("arrays").pack(std::vector<std::string>{"image", "segmentation"});
        socket.send(zmq::buffer(asked.data(), asked.size()), zmq::send_flags::none);

        zmq::message_t message;
        if (!socket.recv(message)) return 1;
        const auto unpacked = msgpack::unpack(static_cast<const char*>(message.data()), message.size());
        auto reply = unpacked.get().as<Map>();
        if (reply.count("error")) return std::cerr << reply["error"].as<std::string>() << "\n", 1;
        auto segmentation = reply["arrays"].as<std::map<std::string, Map>>()["segmentation"];
        const auto shape = segmentation["shape"].as<std::vector<int>>();  // rows, columns; of uint8
        const auto pixels = segmentation["data"].as<std::vector<char>>();
        const auto seen = pixels.size() - std::count(pixels.begin(), pixels.end(), 0);
        std::cout << reply["frame"].as<std::string>() << ": " << distance << " m, " << seen << " of "
                  << shape[0] * shape[1] << " pixels\n";
    }
}
