// What tri_glide_kinematics uses of ruckig, under the names that ruckig's own Python module has.
//
// The Python module of version 0.9.2 has no access to the phases of a trajectory, and no error of its
// own: a calculation that failed is told by a number. Here it raises RuckigError.

#include <cstddef>
#include <stdexcept>
#include <string>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <ruckig/ruckig.hpp>

namespace py = pybind11;

using Calculator = ruckig::Ruckig<ruckig::DynamicDOFs>;
using Input = ruckig::InputParameter<ruckig::DynamicDOFs>;
using Trajectory = ruckig::Trajectory<ruckig::DynamicDOFs>;

namespace {

struct RuckigError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The phases are a private member in version 0.9.2; an explicit instantiation may name one.
template <auto member>
struct Phases {
    friend auto& phases_of(Trajectory& trajectory) { return trajectory.*member; }
};
template struct Phases<&Trajectory::profiles>;
auto& phases_of(Trajectory& trajectory);

std::string text_of(ruckig::Result result) {
    switch (result) {
        case ruckig::Result::ErrorInvalidInput:
            return "invalid input";
        case ruckig::Result::ErrorTrajectoryDuration:
            return "the motion takes longer than ruckig plans";
        case ruckig::Result::ErrorExecutionTimeCalculation:
            return "error in step 1, the duration of each degree of freedom";
        case ruckig::Result::ErrorSynchronizationCalculation:
            return "error in step 2, the degrees of freedom together";
        default:
            return "ruckig gives no reason";
    }
}

void calculate(Calculator& calculator, const Input& input, Trajectory& trajectory) {
    const ruckig::Result result = calculator.calculate(input, trajectory);
    if (result != ruckig::Result::Working && result != ruckig::Result::Finished) {
        throw RuckigError(text_of(result));
    }
}

}  // namespace

PYBIND11_MODULE(tri_glide_ruckig, module) {
    module.doc() = "The part of ruckig that tri_glide_kinematics uses.";
    py::register_exception<RuckigError>(module, "RuckigError");

    py::enum_<ruckig::ControlInterface>(module, "ControlInterface")
        .value("Position", ruckig::ControlInterface::Position)
        .value("Velocity", ruckig::ControlInterface::Velocity);

    py::enum_<ruckig::Synchronization>(module, "Synchronization")
        .value("Phase", ruckig::Synchronization::Phase)
        .value("Time", ruckig::Synchronization::Time)
        .value("TimeIfNecessary", ruckig::Synchronization::TimeIfNecessary)
        .value("No", ruckig::Synchronization::None);

    py::class_<ruckig::BrakeProfile>(module, "BrakeProfile")
        .def_readonly("t", &ruckig::BrakeProfile::t)
        .def_readonly("j", &ruckig::BrakeProfile::j);

    py::class_<ruckig::Profile>(module, "Profile")
        .def_readonly("t", &ruckig::Profile::t)
        .def_readonly("j", &ruckig::Profile::j)
        .def_readonly("brake", &ruckig::Profile::brake);

    py::class_<Trajectory>(module, "Trajectory")
        .def(py::init<std::size_t>(), py::arg("dofs"))
        .def_property_readonly("profiles", [](Trajectory& trajectory) { return phases_of(trajectory); });

    py::class_<Input>(module, "InputParameter")
        .def(py::init<std::size_t>(), py::arg("dofs"))
        .def_readwrite("control_interface", &Input::control_interface)
        .def_readwrite("synchronization", &Input::synchronization)
        .def_readwrite("current_position", &Input::current_position)
        .def_readwrite("current_velocity", &Input::current_velocity)
        .def_readwrite("current_acceleration", &Input::current_acceleration)
        .def_readwrite("target_position", &Input::target_position)
        .def_readwrite("target_velocity", &Input::target_velocity)
        .def_readwrite("target_acceleration", &Input::target_acceleration)
        .def_readwrite("max_velocity", &Input::max_velocity)
        .def_readwrite("max_acceleration", &Input::max_acceleration)
        .def_readwrite("max_jerk", &Input::max_jerk)
        .def_readwrite("min_velocity", &Input::min_velocity)
        .def_readwrite("min_acceleration", &Input::min_acceleration);

    py::class_<Calculator>(module, "Ruckig")
        .def(py::init<std::size_t, double>(), py::arg("dofs"), py::arg("delta_time"))
        .def("calculate", &calculate, py::arg("input"), py::arg("trajectory"));
}
