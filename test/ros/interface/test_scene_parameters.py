"""Tests of scene fields as node parameters: declared from and checked by the scene model, fixed while configured."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.context import Context
from rclpy.exceptions import ParameterUninitializedException
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.parameter import Parameter

from rpf3d_core.errors import InputError
from rpf3d_core.live.scene import live_parameters, live_scene
from rpf3d_ros.interface.declared_parameters import ParameterLock, declare, values_of
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.scene_parameters import SceneParameters, descriptor_of


@pytest.fixture
def node_with():
    """Yield a function that makes a node of class `kind` with the given parameters, in a separate context."""
    made = []

    def make(given, kind=Node, **options):
        context = Context()
        context.init(args=[], domain_id=1)
        words = [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]
        made.append((kind("rpf3d_tested", context=context, cli_args=["--ros-args", *words], **options), context))
        return made[-1][0]

    yield make
    for node, context in made:
        node.destroy_node()
        context.try_shutdown()


GIVEN = {"rock.diameter": 2.0, "ground": "sliding", "effects.drag": "true", "seed": 4}
VALUES = {"rock.diameter": 2.0, "ground": "sliding", "effects.drag": True, "seed": 4}


@pytest.mark.parametrize("kind", [Node, LifecycleNode])
@pytest.mark.parametrize("declared", [False, True])
def test_the_scene_is_that_of_the_values_given_on_the_command_line(node_with, kind, declared):
    described = SceneParameters(node_with(GIVEN, kind, automatically_declare_parameters_from_overrides=declared))
    assert described.given == VALUES
    assert live_scene(described.given) == live_scene(VALUES)


def test_every_field_is_declared_with_its_type_its_range_and_its_default(node_with):
    node = node_with({})
    SceneParameters(node)
    for field in live_parameters():
        about = node.describe_parameter(field.key)
        assert about.description and not about.dynamic_typing
        if field.within or field.default is None:
            with pytest.raises(ParameterUninitializedException):
                node.get_parameter(field.key)
        else:
            assert node.get_parameter(field.key).value == field.default


def test_a_whole_number_is_taken_for_a_length_as_in_a_scene_file(node_with):
    node = node_with({"rock.diameter": 2})
    assert live_scene(SceneParameters(node).given).rock.diameter == 2.0
    assert node.get_parameter("rock.diameter").type_ == Parameter.Type.DOUBLE


@pytest.mark.parametrize(
    ("given", "saying"),
    [
        ({"rock.diameter": 0.0}, "parameter `rock.diameter` is 0.0, but must be a number above 0"),
        ({"materials.default.normal_restitution": 1.1}, "parameter `materials.default.normal_restitution` is 1.1, but"),
        ({"gravity": ".nan"}, "parameter `gravity` is nan, but must be"),
        ({"gravity": "soft"}, "parameter `gravity` is 'soft', but must be"),
        ({"ground": "skating"}, "parameter `ground` is 'skating', but must be none, sliding"),
        ({"rock.shape.sphere": True, "ground": "sliding"}, "goes with none or sphere"),
        ({"max_impacts": 0}, "parameter `max_impacts` is 0, but"),
        ({"engine": "fast"}, "parameter `engine` is 'fast', but must be auto, reference or compiled"),
        ({"scene": "nowhere.yaml"}, "nowhere.yaml: there is no such scene file"),
        ({"scene": "site.yaml", "gravity": 9.81}, "remove it, or these parameters: `gravity`"),
    ],
)
def test_what_makes_no_scene_is_refused_in_the_words_of_a_scene_file(node_with, given, saying):
    with pytest.raises(InputError) as refused:
        SceneParameters(node_with(given))
    assert saying in str(refused.value)


def test_a_range_tells_what_it_cannot_say_in_words(node_with):
    (field,) = (each for each in live_parameters() if each.key == "target.half_width")
    about = descriptor_of(field)
    assert (about.floating_point_range[0].from_value, about.floating_point_range[0].to_value) == (0.0, 0.5)
    assert about.additional_constraints == "not 0 itself; not 0.5 itself"


def test_what_is_set_while_the_node_is_not_configured_is_in_the_next_scene(node_with):
    node = node_with({})
    described = SceneParameters(node)
    results = node.set_parameters([Parameter("rock.mass", value=3.0), Parameter("gravity", value=9.81)])
    assert all(result.successful for result in results)
    assert described.given == {"rock.mass": 3.0, "gravity": 9.81}
    assert live_scene(described.given) == live_scene({"rock.mass": 3.0, "gravity": 9.81})


def test_a_value_out_of_its_range_is_not_set(node_with):
    node = node_with({})
    described = SceneParameters(node)
    assert not node.set_parameters([Parameter("target.half_width", value=0.6)])[0].successful
    assert described.given == {}


def test_what_is_set_and_makes_no_scene_is_refused_when_the_scene_is_asked_for(node_with):
    node = node_with({})
    described = SceneParameters(node)
    node.set_parameters([Parameter("rock.shape.sphere", value=True), Parameter("ground", value="sliding")])
    with pytest.raises(InputError, match="goes with none or sphere"):
        live_scene(described.given)
    node.set_parameters([Parameter("ground", value="sphere")])
    assert live_scene(described.given).impact_model.name == "coulomb_sphere"


def test_while_the_lock_is_closed_only_what_is_free_can_be_set(node_with):
    node = node_with({})
    described = SceneParameters(node)
    declare(node, SimulatorParameters, fixed=False, others=described.names)
    lock = ParameterLock(node, free=("acknowledged_by",))
    lock.closed = True
    kept, free, same, clock = node.set_parameters([
        Parameter("gravity", value=1.6), Parameter("acknowledged_by", value="shift boss: dozer only"),
        Parameter("use_sim_time", value=False), Parameter("use_sim_time", value=True),
    ])  # fmt: skip
    assert (kept.successful, free.successful, same.successful, clock.successful) == (False, True, True, False)
    assert "use_sim_time cannot change while the node is configured" in clock.reason
    assert not node.get_clock().ros_time_is_active
    assert "gravity cannot change while the node is configured" in kept.reason
    assert described.given == {}
    lock.closed = False
    assert node.set_parameters([Parameter("gravity", value=1.6), Parameter("first_rocks", value=7)])[0].successful
    assert live_scene(described.given).gravity == 1.6
    assert values_of(node, SimulatorParameters).first_rocks == 7
    assert node.set_parameters([Parameter("use_sim_time", value=True)])[0].successful


def test_a_misspelt_parameter_is_warned_of_with_the_nearest_name(node_with, capfd):
    node = node_with({"rock.diametre": 2.0})
    declare(node, SimulatorParameters, others=SceneParameters(node).names)
    assert "no parameter rock.diametre, so its value has no effect; did you mean rock.diameter?" in (
        capfd.readouterr().err
    )
